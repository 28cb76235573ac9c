// SPDX-License-Identifier: Apache-2.0
// scenes.h - generated scenes: they need no files.
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

// The alpha puzzle's own geometry: a closed tube of 1,008 triangles swept along an alpha curve.
struct AlphaShape {
  Mesh mesh;
  double tube_radius;  // of the circle that every ring of the mesh is inscribed in [m]
  double gap;          // between the crossing strands' surfaces, computed from the mesh [m]
};
AlphaShape make_alpha();

// Its centre line, mesh frame: a loop for -1 < t < 1, which closes in the xy view at t = -1 and 1,
// where the strands cross one above the other; tails beyond, to t = -/+ alpha_end().
h6Vec3 alpha_point(double t);  // [m]
double alpha_end();

}  // namespace h6::io
