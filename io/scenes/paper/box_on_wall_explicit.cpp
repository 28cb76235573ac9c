// SPDX-License-Identifier: Apache-2.0
// box_on_wall_explicit.cpp - the flat contact of Fig. 2 with explicit integration and without
// contact damping, so that the net stiffness alone decides whether it is stable.
#include <cmath>
#include <numbers>

#include "io/scenes/list.h"
#include "io/scenes/paper/experiments.h"

namespace h6::io {

Scene box_on_wall_explicit(int nu, int nv, const Sampling& sampling) {
  Scene scene = common_scene(
      "box-on-wall-explicit",
      "A box of 20 x 20 x 10 mm with 13 x 14 points under it is pressed 3 mm deep onto a wall and "
      "rocks by 0.05 rad, integrated explicitly and without contact damping: the unscaled penalty "
      "is then unstable at 1e4 N/m. Forbidden: the wall below 3.5 mm.");
  scene.integrator = H6_EXPLICIT;
  scene.contact.damping = 0;
  const double side = 40 * kMm, bottom = -12 * kMm;
  scene.bodies.push_back(obstacle("wall", box_mesh({-side, -side, bottom}, {side, side, 0}), kMm));

  const h6Vec3 half = {10 * kMm, 10 * kMm, 5 * kMm};
  SceneBody box;
  box.name = "box";
  box.com = h6Vec3{0, 0, 0};
  box.inertia = box_inertia(box.mass, half);
  box.pose = {{0, 0, 5.5 * kMm}, {1, 0, 0, 0}};
  box.shell.emplace();
  box.shell->points.emplace();
  Sampler(sampling).face(*box.shell->points, {0, 0, -half.z}, {half.x, 0, 0}, {0, half.y, 0}, nu,
                         nv, {0, 0, 1});
  box.shell->bake.levels = 3;
  scene.bodies.push_back(box);

  HandPath hand(box.pose);
  hand.wait(0.05).move_by({0, 0, -3.5 * kMm}, 40 * kMm);  // 3 N: below the bound, hence damped
  const h6Pose pressed = hand.pose();
  constexpr int kSteps = 60;
  for (int i = 1; i <= kSteps; ++i) {
    const double phase = 2 * std::numbers::pi * i / kSteps;
    const h6Vec3 tilt = {0.05 * std::sin(phase), 0.03 * std::sin(2 * phase), 0};
    hand.go_to({pressed.p + h6Vec3{3 * kMm * std::sin(phase), 0, 0}, turn_by(tilt)}, 0.01);
  }
  // A little deeper at the end: a box that followed the hand would be in the forbidden region.
  hand.move_by({0, 0, -1 * kMm}, 40 * kMm).wait(0.6);
  scene.hands.push_back(path_hand("box", hand.rows()));
  scene.verdict.forbidden.push_back({{-side, -side, bottom}, {side, side, -3.5 * kMm}});
  return scene;
}

Scene box_on_wall_explicit(const Sampling& sampling) {
  return box_on_wall_explicit(13, 14, sampling);
}
Scene box_on_wall_explicit() { return box_on_wall_explicit(Sampling{}); }

}  // namespace h6::io
