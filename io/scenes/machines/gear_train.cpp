// SPDX-License-Identifier: Apache-2.0
// gear_train.cpp - a gear pushed into the mesh of two others and turned against both.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kModule = 2;  // [mm]: pitch radius over half the number of teeth
constexpr int kWheelTeeth = 24, kIdlerTeeth = 18;
constexpr double kFace = 16;              // width of the gears [mm]
constexpr double kGearTrainVoxel = 0.25;  // [mm]
constexpr double kPlayBetween = 0.3;      // added to the distance of the axes [mm]
constexpr double kMiddleOfTooth = 0.55;   // of gear()'s pitch

Mesh gear_mesh(int teeth, double bore, std::size_t triangles) {
  const double pitch = 0.5 * kModule * teeth;
  const Outline outline{gear(teeth, pitch - 1.25 * kModule, pitch + kModule), {circle(bore, 48)}};
  Assembly a(kMm * kGearTrainVoxel, static_cast<std::uint64_t>(teeth));
  a.add("gear", extrude(outline, -0.5 * kFace, 0.5 * kFace));
  return a.sound(triangles);
}

// Turned about z so that the middle of a tooth, or of a gap, points along `angle`.
h6Quat facing_with(int teeth, bool gap, double angle) {
  const double pitch = 2 * std::numbers::pi / teeth;
  return turn_by({0, 0, angle - (kMiddleOfTooth + (gap ? 0.5 : 0)) * pitch});
}

Path idler_path(const h6Pose& start) {
  constexpr double kSpeed = 0.06, kAway = 30 * kMm;
  HandPath hand(start);
  const auto turned = [&](const h6Vec3& w, double seconds) {
    hand.go_to({hand.pose().p, product(turn_by(w), start.q)}, seconds);
  };
  hand.wait(0.1).move_by({0, 0, -kAway}, kSpeed).wait(0.1);
  for (const double angle : {0.15, -0.15, 0.15, 0.0}) {
    turned({0, 0, angle}, 0.15);
    hand.wait(0.6);
  }
  hand.move_by({0, 3 * kMm, 0}, kSpeed).wait(0.1);  // into both wheels
  turned({0, 0, 0.1}, 0.1);
  hand.move_by({0, 0, 4 * kMm}, kSpeed).move_by({0, 0, -4 * kMm}, kSpeed);
  turned({0.05, 0.05, 0}, 0.1);
  hand.wait(0.1);
  turned({0, 0, 0}, 0.1);
  hand.move_by({0, -3 * kMm, 0}, kSpeed).wait(0.1).move_by({0, 0, kAway}, kSpeed).wait(0.5);
  return hand.rows();
}

}  // namespace

Scene gear_train() {
  Scene scene = common_scene(
      "gear-train",
      "A gear of 18 teeth is pushed along its axis into the mesh of two fixed gears of 24, turned "
      "against their teeth to and fro, pressed into both, tilted, and taken out.");
  const double lever = 0.5 * kModule * kIdlerTeeth * kMm;
  scene.coupling.rotational_stiffness = scene.coupling.stiffness * lever * lever;
  scene.coupling.max_torque = scene.contact.stiffness * 0.5 * kMm * kGearTrainVoxel * lever;
  // The wheels stand at angles from which a tooth of the idler points to either.
  const double pitch = 2 * std::numbers::pi / kIdlerTeeth;
  const double axes = kMm * (0.5 * kModule * (kWheelTeeth + kIdlerTeeth) + kPlayBetween);
  for (const int tooth : {2, 7}) {
    const double angle = tooth * pitch;
    SceneBody wheel = obstacle(tooth == 2 ? "right wheel" : "left wheel",
                               gear_mesh(kWheelTeeth, 8, 12000), kMm * kGearTrainVoxel);
    wheel.pose = {axes * h6Vec3{std::cos(angle), std::sin(angle), 0},
                  facing_with(kWheelTeeth, true, angle + std::numbers::pi)};
    scene.bodies.push_back(std::move(wheel));
  }
  SceneBody idler;
  idler.name = "idler";
  idler.pose = {{0, 0, 30 * kMm}, facing_with(kIdlerTeeth, false, 0)};
  idler.shell.emplace();
  idler.shell->mesh_data = gear_mesh(kIdlerTeeth, 6, 10000);
  idler.shell->bake.points = 25269;
  const Path path = idler_path(idler.pose);
  scene.hands.push_back(path_hand("idler", path));
  scene.verdict.target = path.back().pose;
  scene.verdict.tolerance = kMm, scene.verdict.tolerance_angle = 0.05;
  scene.bodies.push_back(std::move(idler));
  return scene;
}

}  // namespace h6::io
