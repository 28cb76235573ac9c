// SPDX-License-Identifier: Apache-2.0
// box_on_wall.cpp - the simplest contact: many parallel points on a flat wall (cf. Fig. 2).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/scenes/list.h"
#include "io/scenes/paper/experiments.h"

namespace h6::io {
namespace {

// Six faces of the box |x|, |y|, |z| <= half, points `spacing` apart or a little less.
void add_box(PointCloud& cloud, const h6Vec3& half, double spacing, Sampler& sampler) {
  const h6Vec3 axes[3] = {{half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z}};
  // The tolerance keeps rounding from adding a point to a side that is a multiple of the spacing.
  const auto cells = [&](const h6Vec3& axis) {
    return std::max(1, static_cast<int>(std::ceil(2 * norm(axis) / spacing - 1e-9)));
  };
  for (int a = 0; a < 3; ++a)
    for (const double side : {-1.0, 1.0}) {
      const h6Vec3 &n = axes[a], &u = axes[(a + 1) % 3], &v = axes[(a + 2) % 3];
      sampler.face(cloud, side * n, u, v, cells(u), cells(v), -side * unit(n));
    }
}

}  // namespace

Scene box_on_wall(const Sampling& sampling) {
  Scene scene = common_scene(
      "box-on-wall",
      "A box of 20 x 20 x 10 mm is pressed 3 mm deep onto a wall, rocks by 0.05 rad and slides by "
      "3 mm, then rests. Forbidden: the wall below 3 mm.");
  const double top = 0, bottom = -12 * kMm, side = 40 * kMm;
  scene.bodies.push_back(
      obstacle("wall", box_mesh({-side, -side, bottom}, {side, side, top}), kMm));

  const h6Vec3 half = {10 * kMm, 10 * kMm, 5 * kMm};
  SceneBody box;
  box.name = "box";
  box.com = h6Vec3{0, 0, 0};
  box.inertia = box_inertia(box.mass, half);
  box.pose = {{0, 0, 6 * kMm}, {1, 0, 0, 0}};  // 1 mm above the wall
  box.shell.emplace();
  box.shell->points.emplace();
  Sampler sampler(sampling);
  add_box(*box.shell->points, half, 1.5 * kMm, sampler);
  box.shell->bake.levels = 4;
  scene.bodies.push_back(box);

  HandPath hand(box.pose);
  hand.wait(0.05).move_by({0, 0, -4 * kMm}, 40 * kMm);  // 3 mm below contact
  const h6Pose pressed = hand.pose();
  const int steps = 100;
  for (int i = 1; i <= steps; ++i) {  // one second, ends where it began
    const double phase = 2 * std::numbers::pi * i / steps;
    const h6Vec3 slide = {3 * kMm * std::sin(phase), 0, 0};
    const h6Vec3 tilt = {0.05 * std::sin(phase), 0.03 * std::sin(2 * phase), 0};
    hand.go_to({pressed.p + slide, turn_by(tilt)}, 0.01);
  }
  hand.wait(0.5);
  scene.hands.push_back(path_hand("box", hand.rows()));

  scene.verdict.forbidden.push_back({{-side, -side, bottom}, {side, side, -3 * kMm}});
  return scene;
}

Scene box_on_wall() { return box_on_wall(Sampling{}); }

}  // namespace h6::io
