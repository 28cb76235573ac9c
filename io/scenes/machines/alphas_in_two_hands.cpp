// SPDX-License-Identifier: Apache-2.0
// alphas_in_two_hands.cpp - the alpha puzzle with an alpha in either hand, pulled at its shortcut.
#include "io/scenes/list.h"
#include "io/scenes/shapes.h"

namespace h6::io {

// Each hand goes half of alpha-shortcut's way, in opposite directions, so that between the alphas
// the same happens.
Scene alphas_in_two_hands() {
  Scene scene = alpha_shortcut();
  scene.name = "alphas-in-two-hands";
  scene.about =
      "Two alphas hooked together, one in each hand. The hands pull them apart along a strand of "
      "one, through the gap of the other, which is narrower than the tube, with 20 N each.";
  scene.verdict.forbidden.clear();  // it was a place beside an alpha that stands still
  scene.bodies[0].name = "left", scene.bodies[1].name = "right";
  scene.bodies[0].fixed = false;
  SceneHand& right = scene.hands[0];
  right.body = "right";
  const h6Pose from = right.path.front().pose;
  Path left;
  for (PathRow& row : right.path) {
    const h6Vec3 half = 0.5 * (row.pose.p - from.p);
    left.push_back({row.t, {-half, {1, 0, 0, 0}}});
    row.pose.p = from.p + half;
  }
  scene.hands.push_back(path_hand("left", left));
  return scene;
}

}  // namespace h6::io
