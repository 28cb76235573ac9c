// SPDX-License-Identifier: Apache-2.0
// cone_in_gap.cpp - a cone pulled into a gap that is lower than the cone is high (Fig. 3): hundreds
// of contacts on the floor against a handful at the ceiling.
#include <cmath>
#include <numbers>

#include "io/scenes/list.h"
#include "io/scenes/paper/experiments.h"

namespace h6::io {
namespace {

// The cone stands on z = 0 with its apex at `height`; the points of base and side are `spacing`
// apart, relative to `com`.
PointCloud cone_shell(double radius, double height, double spacing, const h6Vec3& com,
                      Sampler& sampler) {
  PointCloud cloud;
  const int reach = static_cast<int>(std::ceil(radius / spacing));
  for (int i = -reach; i <= reach; ++i)
    for (int j = -reach; j <= reach; ++j) {
      const h6Vec3 p = {(i + sampler.shift()) * spacing, (j + sampler.shift()) * spacing, 0};
      if (norm(p) < radius) add_shell_point(cloud, p - com, {0, 0, 1});
    }
  const int rows = static_cast<int>(std::ceil(std::hypot(radius, height) / spacing));
  for (int i = 0; i < rows; ++i) {
    const double along = (i + 0.5) / rows, ring = radius * (1 - along);
    const int count =
        std::max(1, static_cast<int>(std::lround(2 * std::numbers::pi * ring / spacing)));
    for (int j = 0; j < count; ++j) {
      const double angle = 2 * std::numbers::pi * (j + 0.5 * (i % 2) + sampler.shift()) / count;
      const double t = (i + 0.5 + sampler.shift()) / rows;
      const h6Vec3 out = {std::cos(angle), std::sin(angle), 0};
      const h6Vec3 normal = unit(height * out + radius * h6Vec3{0, 0, 1});
      add_shell_point(cloud, radius * (1 - t) * out + h6Vec3{0, 0, t * height} - com,
                      -1.0 * normal);
    }
  }
  add_shell_point(cloud, h6Vec3{0, 0, height} - com, {0, 0, -1});
  return cloud;
}

}  // namespace

Scene cone_in_gap(const Sampling& sampling) {
  Scene scene = common_scene(
      "cone-in-gap",
      "A cone (R = 10 mm, 20 mm high) stands 0.1 mm above a floor and is pulled 24 mm sideways, "
      "pressed down by 0.5 mm, under a ceiling that is 18 mm high. Forbidden: more than 14 mm into "
      "the gap, where the cone's foot is only once its tip has slid under the ceiling's edge.");
  const double radius = 10 * kMm, height = 20 * kMm, gap = 18 * kMm, wide = 40 * kMm;
  scene.bodies.push_back(
      obstacle("floor", box_mesh({-wide, -wide, -12 * kMm}, {60 * kMm, wide, 0}), kMm));
  scene.bodies.push_back(
      obstacle("ceiling", box_mesh({0, -wide, gap}, {60 * kMm, wide, 30 * kMm}), kMm));

  SceneBody cone;
  cone.name = "cone";
  const h6Vec3 com = {0, 0, height / 4};
  cone.com = h6Vec3{0, 0, 0};  // the mesh frame stands at the centre of mass
  const double across = cone.mass * (0.15 * radius * radius + 0.0375 * height * height);
  cone.inertia = {across, across, 0.3 * cone.mass * radius * radius, 0, 0, 0};
  cone.pose = {{-4 * kMm, 0, 5.1 * kMm}, {1, 0, 0, 0}};
  Sampler sampler(sampling);
  cone.shell.emplace();
  cone.shell->points = cone_shell(radius, height, sampler.spacing(0.7 * kMm), com, sampler);
  cone.shell->bake.levels = 5;
  scene.bodies.push_back(cone);

  HandPath hand(cone.pose);
  hand.wait(0.05).move_by({0, 0, -0.6 * kMm}, 40 * kMm);
  hand.move_by({24 * kMm, 0, 0}, 50 * kMm).wait(0.5);
  scene.hands.push_back(path_hand("cone", hand.rows()));
  scene.verdict.forbidden.push_back({{14 * kMm, -wide, -12 * kMm}, {60 * kMm, wide, 30 * kMm}});
  return scene;
}

Scene cone_in_gap() { return cone_in_gap(Sampling{}); }

}  // namespace h6::io
