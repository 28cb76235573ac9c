// SPDX-License-Identifier: Apache-2.0
// tasks.h - what the peers are compared on: a part, an obstacle, and 1,000 poses of the part.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/field/field_data.h"
#include "io/mesh/ray_scene.h"
#include "io/scene/load_scene.h"

namespace h6::peers {

struct Task {
  std::string name, about;
  std::unique_ptr<io::LoadedScene> scene;  // body 0 has the field, body 1 the shell
  io::Mesh obstacle, part;                 // as triangles, each in its body's frame [m]
  io::FieldData field;                     // the same as the scene's
  std::vector<h6Vec3> points;              // of the shell in Morton order, part's frame [m]
  std::vector<std::uint32_t> order;        // their numbers in the shell
  // 1,000 poses part -> obstacle from consecutive frames at 1 kHz of a run of the scene, from the
  // first that touches on, and the same in random order.
  std::vector<h6Pose> path, shuffled;
};

std::vector<std::string> task_names();
Result<std::unique_ptr<Task>> make_task(const std::string& name);

}  // namespace h6::peers
