// SPDX-License-Identifier: Apache-2.0
// scene_drawing.h - the bodies of a scene for the page to draw.
//
// A body with a mesh is drawn as that mesh, with 16 bits a coordinate on a cube around it (15 um
// for a part of 1 m), and simplified when it has more triangles than the limit. A body with only a
// baked shell is drawn as the shell's points; one with only a baked field is not drawn. A body that
// bends comes with the modes of its drawn vertices, 16 bits a displacement, and with their turns
// where it is warped.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "io/scene/load_scene.h"
#include "io/view/envelope.h"

namespace h6::io::view {

struct DrawLimits {
  std::size_t triangles = 250000;  // of all bodies together: 60 Hz on a laptop's graphics
};

// Adds position<i>, index<i>, modes<i>, turns<i> or points<i> of body i to `envelope`, and returns
// the head's part: {"bodies": [{"name", "fixed", "pose", "com", "origin", "step", "modes",
// "mode_step", "turn_step"}], "hand_body", "voxel", "unit", "per_metre", "name"}. A file that
// cannot be read is a sentence in `remarks`, not a failure.
nlohmann::ordered_json draw_scene(const LoadedScene& scene, const DrawLimits& limits,
                                  Envelope& envelope, std::vector<std::string>& remarks);

}  // namespace h6::io::view
