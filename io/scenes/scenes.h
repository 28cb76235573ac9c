// SPDX-License-Identifier: Apache-2.0
// scenes.h - makes the built-in scenes by name; they need no files.
#pragma once
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/scene/scene.h"

namespace h6::io {

struct SceneName {
  std::string name;   // kebab-case
  std::string about;  // one line
};
std::vector<SceneName> scene_names();
Result<Scene> make_scene(const std::string& name);

// One piece of the alpha puzzle: a closed tube of 1,008 triangles swept along an alpha curve.
struct AlphaShape {
  Mesh mesh;
  double tube_radius;  // radius of the circle in which every ring of the mesh is inscribed [m]
  double gap;          // distance of the crossing strands' surfaces, computed from the mesh [m]
};
AlphaShape make_alpha();

// The alpha's centre line in the mesh frame. The loop is -1 < t < 1. Seen along z it closes at
// t = -1 and 1, where one strand crosses above the other. The tails end at t = -/+ alpha_end().
h6Vec3 alpha_point(double t);  // [m]
double alpha_end();

}  // namespace h6::io
