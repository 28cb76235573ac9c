// SPDX-License-Identifier: Apache-2.0
// peg_in_hole.cpp - a tight conforming fit with contacts all around (Fig. 10).
#include <cmath>
#include <numbers>

#include "io/scenes/list.h"
#include "io/scenes/paper/experiments.h"

namespace h6::io {
namespace {

// Samples the peg's side by 60 x 40 cells, and its bottom by points 4 mm apart.
void add_peg(PointCloud& cloud, double radius, double half_length, Sampler& sampler) {
  const int around = sampler.along(60), along = sampler.along(40);
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < along; ++j) {
      const double angle = 2 * std::numbers::pi * sampler.in_cell(i) / around;
      const h6Vec3 out = {std::cos(angle), std::sin(angle), 0};
      const double z = half_length * (2 * sampler.in_cell(j) / along - 1);
      add_shell_point(cloud, radius * out + h6Vec3{0, 0, z}, -1.0 * out);
    }
  const double spacing = sampler.spacing(4 * kMm);
  const int reach = static_cast<int>(std::ceil(radius / spacing));
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j) {
      const h6Vec3 p = {(i + sampler.shift()) * spacing, (j + sampler.shift()) * spacing, 0};
      if (norm(p) < radius) add_shell_point(cloud, p - h6Vec3{0, 0, half_length}, {0, 0, 1});
    }
}

}  // namespace

Scene peg_in_hole(const Sampling& sampling) {
  Scene scene = common_scene(
      "peg-in-hole",
      "A peg (R = 10 mm) in a blind hole (R = 10.3 mm, 30 mm deep) is pressed 8 mm sideways, then "
      "20 mm down, 10 mm past the floor. Forbidden: the block, 3 mm under its surface.");
  const double side = 25 * kMm, height = 40 * kMm, hole = 10.3 * kMm, floor = 30 * kMm;
  scene.bodies.push_back(obstacle("block", block_with_hole(side, height, hole, floor, 128), kMm));

  const double radius = 10 * kMm, half_length = 15 * kMm;
  SceneBody peg;
  peg.name = "peg";
  peg.com = h6Vec3{0, 0, 0};
  peg.inertia = cylinder_inertia(peg.mass, radius, half_length);
  peg.pose = {{0, 0, -5 * kMm}, {1, 0, 0, 0}};  // its bottom 10 mm above the floor
  peg.shell.emplace();
  peg.shell->points.emplace();
  Sampler sampler(sampling);
  add_peg(*peg.shell->points, radius, half_length, sampler);
  peg.shell->bake.levels = 5;
  scene.bodies.push_back(peg);

  const double speed = 40 * kMm;
  HandPath hand(peg.pose);
  hand.wait(0.05).move_by({8 * kMm, 0, 0}, speed).wait(0.15);
  hand.move_by({0, 0, -20 * kMm}, speed).wait(0.5);
  scene.hands.push_back(path_hand("peg", hand.rows()));

  // Forbidden: the region under the floor, and the block on all four sides of the hole.
  const double deep = 3 * kMm, wall = hole + deep;
  scene.verdict.forbidden = {
      {{-side, -side, -height}, {side, side, -floor - deep}},
      {{wall, -side, -height}, {side, side, -deep}},
      {{-side, -side, -height}, {-wall, side, -deep}},
      {{-side, wall, -height}, {side, side, -deep}},
      {{-side, -side, -height}, {side, -wall, -deep}},
  };
  return scene;
}

Scene peg_in_hole() { return peg_in_hole(Sampling{}); }

}  // namespace h6::io
