// SPDX-License-Identifier: Apache-2.0
// piston_in_bore.cpp - a piston in a blind bore with a quarter of a voxel of play.
#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"

namespace h6::io {
namespace {

constexpr double kPistonRadius = 24, kPistonLength = 40, kBoreDepth = 60;  // [mm]
constexpr double kBoreVoxel = 0.5;                                         // [mm]

Mesh piston_mesh() {
  industrial::Assembly a(kMm * kBoreVoxel, 128);
  a.add("piston",
        industrial::cylinder(kPistonRadius, -0.5 * kPistonLength, 0.5 * kPistonLength, 128));
  return a.sound(12000);
}

// The hand lowers the piston into the bore, presses it aside, slides, twists and tilts it there,
// presses it on the floor, and takes it out.
Path piston_path(const h6Pose& start) {
  constexpr double kSpeed = 0.06;
  HandPath hand(start);
  hand.wait(0.1).move_by({0, 0, -63 * kMm}, kSpeed).wait(0.1);
  hand.move_by({4 * kMm, 0, 0}, kSpeed).wait(0.6);
  for (const double z : {8.0, -16.0, 8.0}) hand.move_by({0, 0, z * kMm}, kSpeed);
  const auto turned = [&](const h6Vec3& w) {
    hand.go_to({hand.pose().p, product(turn_by(w), start.q)}, 0.2).wait(0.6);
  };
  turned({0, 0, 0.5}), turned({0.05, 0, 0.5}), turned({0, 0, 0});
  hand.move_by({-4 * kMm, 0, 0}, kSpeed).move_by({0, 0, -20 * kMm}, kSpeed).wait(0.6);
  hand.move_by({0, 0, 83 * kMm}, kSpeed).wait(0.5);
  return hand.rows();
}

}  // namespace

Scene piston_in_bore() {
  Scene scene = common_scene(
      "piston-in-bore",
      "A piston of 48 mm is lowered into a blind bore with a quarter of a voxel of play, pressed "
      "aside, slid, twisted, tilted, pressed on the floor 10 mm past it, and taken out.");
  scene.coupling.rotational_stiffness = scene.coupling.stiffness * 24 * kMm * 24 * kMm;
  scene.coupling.max_torque = scene.contact.stiffness * 0.5 * kMm * kBoreVoxel * 24 * kMm;
  const double radius = kMm * (kPistonRadius + 0.25 * kBoreVoxel);
  scene.bodies.push_back(
      obstacle("bore", block_with_hole(32 * kMm, 68 * kMm, radius, kMm * kBoreDepth, 128),
               kMm * kBoreVoxel));
  SceneBody piston;
  piston.name = "piston";
  piston.pose = {{0, 0, 30 * kMm}, {1, 0, 0, 0}};
  piston.shell.emplace();
  piston.shell->mesh_data = piston_mesh();
  piston.shell->bake.points = 10000;
  const Path path = piston_path(piston.pose);
  scene.hands.push_back(path_hand("piston", path));
  scene.verdict.target = path.back().pose;
  scene.verdict.tolerance = kMm, scene.verdict.tolerance_angle = 0.02;
  scene.bodies.push_back(std::move(piston));
  return scene;
}

}  // namespace h6::io
