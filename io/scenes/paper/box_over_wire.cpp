// SPDX-License-Identifier: Apache-2.0
// box_over_wire.cpp - a box dragged over a plate against a thin obstacle (Fig. 12): a low wire or a
// post.
#include <numbers>

#include "io/scenes/list.h"
#include "io/scenes/paper/experiments.h"

namespace h6::io {
namespace {

// Adds everything but the obstacle.
Scene dragged_box(Scene scene, const Sampling& sampling) {
  const h6Vec3 half = {6 * kMm, 6 * kMm, 4 * kMm};
  SceneBody box;
  box.name = "box";
  box.com = h6Vec3{0, 0, 0};
  box.inertia = box_inertia(box.mass, half);
  box.pose = {{0, 0, half.z + 0.05 * kMm}, {1, 0, 0, 0}};
  box.shell.emplace();
  box.shell->points.emplace();
  Sampler sampler(sampling);
  sampler.face(*box.shell->points, {0, 0, -half.z}, {half.x, 0, 0}, {0, half.y, 0}, 30, 30,
               {0, 0, 1});
  sampler.face(*box.shell->points, {half.x, 0, 0}, {0, half.y, 0}, {0, 0, half.z}, 30, 20,
               {-1, 0, 0});
  box.shell->bake.levels = 5;
  scene.bodies.push_back(box);

  HandPath hand(box.pose);
  hand.wait(0.05).move_by({0, 0, 2 * kMm - box.pose.p.z}, 40 * kMm);  // 2 mm into the plate
  hand.move_by({15 * kMm, 0, 0}, 40 * kMm).wait(0.5);
  scene.hands.push_back(path_hand("box", hand.rows()));

  // The front face rests at x = 8 mm; the obstacle's far side is at 10 mm.
  const double side = 24 * kMm;
  scene.verdict.forbidden.push_back({{10.5 * kMm, -side, -12 * kMm}, {60 * kMm, side, 30 * kMm}});
  return scene;
}

void add_plate(Scene& scene) {
  const double side = 25 * kMm;
  scene.bodies.push_back(
      obstacle("plate", box_mesh({-side, -side, -12 * kMm}, {side, side, 0}), kMm));
}

}  // namespace

Scene box_over_wire(const Sampling& sampling) {
  Scene scene = common_scene(
      "box-over-wire",
      "A box of 12 x 12 x 8 mm is pressed on a plate and dragged 15 mm against a wire (r = 1 mm) "
      "that lies on the plate, its axis 0.6 mm high. Plate and wire are fields of their own. "
      "Forbidden: beyond the wire.");
  add_plate(scene);
  // An upright cylinder, laid down along y.
  const Mesh upright = prism_mesh({0, 0, 0}, kMm, -25 * kMm, 25 * kMm, 64);
  const h6Pose place = {{9 * kMm, 0, 0.6 * kMm}, turn_by({std::numbers::pi / 2, 0, 0})};
  scene.bodies.push_back(obstacle("wire", moved(upright, place), kMm));
  return dragged_box(std::move(scene), sampling);
}

Scene box_over_fused_wire(const Sampling& sampling) {
  Scene scene = common_scene(
      "box-over-fused-wire",
      "As box-over-wire, but plate and wire are one mesh and one field. Voxels of 1 mm would round "
      "off the corner between them, where the box's edge comes to lie, so the field keeps a "
      "tolerance of a third of a millimetre. Forbidden: beyond the wire.");
  SceneBody plate =
      obstacle("plate", plate_with_wire(25 * kMm, 12 * kMm, 9 * kMm, 0.6 * kMm, kMm, 32), 0);
  plate.field->bake.tolerance = kMm / 3;
  scene.bodies.push_back(std::move(plate));
  scene.coupling.max_force = 5;  // that of the other scenes, although the samples are finer
  return dragged_box(std::move(scene), sampling);
}

Scene box_over_post(const Sampling& sampling) {
  Scene scene = common_scene(
      "box-over-post",
      "A box of 12 x 12 x 8 mm is pressed on a plate and dragged 15 mm against an upright post (r "
      "= 1 mm), 1 mm off its middle. Forbidden: beyond the post.");
  add_plate(scene);
  scene.bodies.push_back(
      obstacle("post", prism_mesh({9 * kMm, 1 * kMm, 0}, kMm, -5 * kMm, 30 * kMm, 64), kMm));
  return dragged_box(std::move(scene), sampling);
}

Scene box_over_fused_wire() { return box_over_fused_wire(Sampling{}); }
Scene box_over_wire() { return box_over_wire(Sampling{}); }
Scene box_over_post() { return box_over_post(Sampling{}); }

}  // namespace h6::io
