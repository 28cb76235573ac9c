// SPDX-License-Identifier: Apache-2.0
// rod_between_tubes.cpp - a rod pushed with 20 N at a gap narrower than the rod (the simplest form
// of Fig. 8).
#include <cmath>
#include <numbers>

#include "io/scenes/list.h"
#include "io/scenes/paper/experiments.h"

namespace h6::io {

Scene rod_between_tubes(const Sampling& sampling) {
  Scene scene = common_scene(
      "rod-between-tubes",
      "A rod of 6 mm is pressed with up to 20 N, four times the force that presses a lone "
      "contact half a voxel deep, at the gap of 4 mm between two fixed tubes of 6 mm. Forbidden: "
      "beyond the gap.");
  // Four times the common stiffness for four times the force: the coupling saturates at the same 5
  // mm.
  scene.coupling.stiffness = 4e3;
  scene.coupling.rotational_stiffness = 3.6;  // k_VC (30 mm)^2
  scene.coupling.max_force = 20;
  scene.coupling.max_torque = 0.6;  // 20 N x 30 mm

  const double radius = 3 * kMm, apart = 5 * kMm, reach = 30 * kMm;
  for (const double side : {-1.0, 1.0})
    scene.bodies.push_back(obstacle(side < 0 ? "left" : "right",
                                    prism_mesh({side * apart, 0, 0}, radius, -reach, reach, 64),
                                    kMm));

  const double half_length = 15 * kMm;
  SceneBody rod;
  rod.name = "rod";
  rod.com = h6Vec3{0, 0, 0};
  rod.inertia = cylinder_inertia(rod.mass, radius, half_length);
  rod.pose = {{0, -6 * kMm, 0}, {1, 0, 0, 0}};
  rod.shell.emplace();
  rod.shell->points.emplace();
  Sampling random = sampling;
  // The plain sampling is random already, so a jittered one only takes another seed.
  if (sampling.jitter > 0) random.seed += 1000;
  Sampler sampler(random);
  const int count = sampler.count(1440);
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * sampler.unit();
    const double z = half_length * (2 * sampler.unit() - 1);
    const h6Vec3 out = {std::cos(angle), std::sin(angle), 0};
    add_shell_point(*rod.shell->points, radius * out + h6Vec3{0, 0, z}, -1.0 * out);
  }
  rod.shell->bake.levels = 5;
  scene.bodies.push_back(rod);

  HandPath hand(rod.pose);
  hand.wait(0.05).move_by({0, 16 * kMm, 0}, 50 * kMm).wait(0.5);
  scene.hands.push_back(path_hand("rod", hand.rows()));
  // The front of a rod that is held stays at y = -0.3 mm.
  scene.verdict.forbidden.push_back(
      {{-20 * kMm, 3.5 * kMm, -60 * kMm}, {20 * kMm, 30 * kMm, 60 * kMm}});
  return scene;
}

Scene rod_between_tubes() { return rod_between_tubes(Sampling{}); }

}  // namespace h6::io
