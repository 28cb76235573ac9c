// SPDX-License-Identifier: Apache-2.0
// wire_bundle.cpp - a blunt bar dragged over a bundle of wires two voxels thick.
#include <cmath>

#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kWireVoxel = 0.5;                 // [mm]
constexpr double kWireRadius = 1.03 * kWireVoxel;  // wires are two voxels thick

// Two bundles of 19 wires that cross in an arch, with ties. The pieces touch and overlap, as in a
// loom, so this is a soup.
Mesh bundle_mesh() {
  Assembly a(kMm * kWireVoxel, 19);
  add_bundle(a, "loom", {{-60, 0, -6}, {-25, 4, 1}, {0, -3, 3}, {25, 4, 1}, {60, 0, -6}}, 19,
             kWireRadius);
  add_bundle(a, "branch", {{-6, -50, -9}, {4, -20, -4}, {-3, 0, -5}, {5, 20, -4}, {0, 50, -9}}, 19,
             kWireRadius);
  return a.sound(a.triangles());
}

// The hand presses the bar 8 mm into the loom, drags it along and across, turns it edgewise, digs
// between the wires, and lifts it away.
Path bar_path(const h6Pose& start) {
  constexpr double kSpeed = 0.06;
  HandPath hand(start);
  const auto turned = [&](const h6Vec3& w) {
    hand.go_to({hand.pose().p, product(turn_by(w), start.q)}, 0.25).wait(0.6);
  };
  hand.wait(0.1).move_by({0, 0, -28 * kMm}, kSpeed).wait(0.6);
  hand.move_by({15 * kMm, 0, 0}, kSpeed).move_by({-30 * kMm, 0, 0}, kSpeed).wait(0.1);
  turned({0, 0.6, 0}), turned({0, 0.6, 0.7});
  hand.move_by({10 * kMm, 12 * kMm, -4 * kMm}, kSpeed).wait(0.1);
  hand.move_by({0, -24 * kMm, 0}, kSpeed).wait(0.6);
  turned({0.5, 0, 0});
  hand.move_by({5 * kMm, 12 * kMm, 0}, kSpeed).wait(0.6);
  turned({0, 0, 0});
  hand.move_by({0, 0, 32 * kMm}, kSpeed).wait(0.5);
  return hand.rows();
}

}  // namespace

Scene wire_bundle() {
  Scene scene = common_scene(
      "wire-bundle",
      "A bar of 60 x 8 x 16 mm is pressed 8 mm into a loom of 38 wires two voxels thick, dragged "
      "along and across it, turned edgewise, dug between the wires, and lifted away.");
  const double lever = 30 * kMm;
  scene.coupling.rotational_stiffness = scene.coupling.stiffness * lever * lever;
  scene.coupling.max_torque = scene.contact.stiffness * 0.5 * kMm * kWireVoxel * lever;
  scene.bodies.push_back(obstacle("loom", bundle_mesh(), kMm * kWireVoxel));
  SceneBody bar;
  bar.name = "bar";
  bar.pose = {{0, 0, 26 * kMm}, {1, 0, 0, 0}};
  bar.shell.emplace();
  Assembly a(kMm * kWireVoxel, 1);
  a.add("bar", block(8, 60, 16, 2, 1.5));
  bar.shell->mesh_data = a.sound(8000);
  bar.shell->bake.points = 25269;
  scene.hands.push_back(path_hand("bar", bar_path(bar.pose)));
  scene.bodies.push_back(std::move(bar));
  return scene;
}

}  // namespace h6::io
