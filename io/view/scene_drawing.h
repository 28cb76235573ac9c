// SPDX-License-Identifier: Apache-2.0
// scene_drawing.h - the bodies of a scene as the page draws them.
//
// A body with a mesh is drawn by it, 16 bits a coordinate on a cube around it (for a part of 1 m:
// 15 um), simplified where it has more triangles than asked for. One with a baked shell only is
// drawn by its points; one with a baked field only is not drawn.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "io/scene/load_scene.h"
#include "io/view/envelope.h"

namespace h6::io::view {

struct DrawLimits {
  std::size_t triangles = 250000;  // of all bodies together: 60 Hz on a laptop's graphics
};

// Adds position<i>, index<i> or points<i> of body i to `envelope`, and returns the head's part:
// {"bodies": [{"name", "fixed", "pose", "com", "origin", "step"}], "hand_body", "voxel", "unit",
// "per_metre", "name"}. What cannot be read is a sentence in `remarks`, not a failure.
nlohmann::ordered_json draw_scene(const LoadedScene& scene, const DrawLimits& limits,
                                  Envelope& envelope, std::vector<std::string>& remarks);

}  // namespace h6::io::view
