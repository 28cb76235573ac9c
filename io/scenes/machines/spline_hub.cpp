// SPDX-License-Identifier: Apache-2.0
// spline_hub.cpp - a splined shaft in its hub: many contacts at once, all of which carry torque.
//
// The hand lowers the shaft into the hub, turns it against the flanks, slides it to and fro under
// torque, turns it the other way, tilts it and pulls it aside, and takes it out again. When it
// skips a tooth on the way it does not arrive.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr int kTeeth = 24;
constexpr double kRoot = 23, kTip = 26;            // radii of the shaft [mm]
constexpr double kAtRoot = 0.075, kAtTip = 0.055;  // half a tooth's width there [rad]
constexpr double kLength = 40, kHubRadius = 34;    // [mm]
constexpr double kSplineVoxel = 0.25;              // [mm]
constexpr double kPlay = 0.25 * kSplineVoxel;      // between all flanks, roots and tips

// The outline of the shaft, or of the hub's bore, which is `play` larger everywhere.
Polygon spline(double play) {
  Polygon out;
  const double root = kRoot + play, tip = kTip + play;
  const double at_root = kAtRoot + play / root, at_tip = kAtTip + play / tip;
  const double pitch = 2 * std::numbers::pi / kTeeth;
  for (int i = 0; i < kTeeth; ++i) {
    const auto add = [&](double r, double angle) {
      out.push_back({r * std::cos(i * pitch + angle), r * std::sin(i * pitch + angle)});
    };
    add(root, -at_root), add(tip, -at_tip), add(tip, 0), add(tip, at_tip), add(root, at_root);
    add(root, 0.5 * pitch);
  }
  return out;
}

Mesh shaft_mesh() {
  Assembly a(kMm * kSplineVoxel, kTeeth);
  a.add("splined shaft", extrude({spline(0), {}}, -0.5 * kLength, 0.5 * kLength));
  return a.sound(18000);
}

Mesh hub_mesh() {
  Assembly a(kMm * kSplineVoxel, kTeeth);
  a.add("hub", extrude({circle(kHubRadius, 96), {spline(kPlay)}}, -0.5 * kLength, 0.5 * kLength));
  return a.sound(24000);
}

Path shaft_path(const h6Pose& start) {
  constexpr double kDown = 45 * kMm, kSpeed = 0.06;
  HandPath hand(start);
  const auto turned = [&](const h6Vec3& w, double seconds) {
    hand.go_to({hand.pose().p, product(turn_by(w), start.q)}, seconds);
  };
  hand.wait(0.1).move_by({0, 0, -kDown}, kSpeed).wait(0.1);
  turned({0, 0, 0.05}, 0.2);
  hand.wait(0.6);
  for (const double z : {4.0, -8.0, 8.0, -4.0}) hand.move_by({0, 0, z * kMm}, 0.05);
  turned({0, 0, -0.05}, 0.3);
  hand.wait(0.6);
  turned({0.04, 0, 0}, 0.2);
  hand.wait(0.6).move_by({0, 2 * kMm, 0}, 0.02).wait(0.6);
  turned({0, 0, 0}, 0.2);
  hand.move_by({0, -2 * kMm, 0}, 0.02).wait(0.1).move_by({0, 0, kDown}, kSpeed).wait(0.5);
  return hand.rows();
}

// About a quarter of the shaft's points lie on the flanks that carry its torque.
Scene spline_hub(const std::string& name, const std::string& contacts, std::size_t points) {
  Scene scene = common_scene(
      name,
      "A splined shaft of 24 teeth is lowered into its hub, turned against the flanks, slid "
      "under torque, tilted and taken out. About " +
          contacts +
          " of its points lie on the flanks that carry the torque. The play is a quarter of a "
          "voxel.");
  const double lever = 0.5 * kMm * (kRoot + kTip);
  scene.coupling.rotational_stiffness = scene.coupling.stiffness * lever * lever;
  scene.coupling.max_torque = scene.contact.stiffness * 0.5 * kMm * kSplineVoxel * lever;
  scene.bodies.push_back(obstacle("hub", hub_mesh(), kMm * kSplineVoxel));
  SceneBody shaft;
  shaft.name = "shaft";
  shaft.pose = {{0, 0, 45 * kMm}, {1, 0, 0, 0}};
  shaft.shell.emplace();
  shaft.shell->mesh_data = shaft_mesh();
  shaft.shell->bake.points = points;
  const Path path = shaft_path(shaft.pose);
  scene.hands.push_back(path_hand("shaft", path));
  scene.verdict.target = path.back().pose;
  scene.verdict.tolerance = kMm, scene.verdict.tolerance_angle = 0.02;
  scene.bodies.push_back(std::move(shaft));
  return scene;
}

}  // namespace

Scene spline_hub_1k() { return spline_hub("spline-hub-1k", "1,000", 4200); }
Scene spline_hub_10k() { return spline_hub("spline-hub-10k", "10,000", 42000); }
Scene spline_hub_100k() { return spline_hub("spline-hub-100k", "100,000", 420000); }

}  // namespace h6::io
