// SPDX-License-Identifier: Apache-2.0
// box_on_plates.cpp - a box pressed on two plates of very different size (Fig. 7): the few contacts
// on the small plate must carry their side of the box.
#include <cmath>

#include "io/scenes/list.h"
#include "io/scenes/paper/experiments.h"

namespace h6::io {
namespace {

const h6Vec3 kHalfBox = {20 * kMm, 10 * kMm, 5 * kMm};

void press_box(Scene& scene, const Sampling& sampling, int nu, int nv) {
  SceneBody box;
  box.name = "box";
  box.com = h6Vec3{0, 0, 0};
  box.inertia = box_inertia(box.mass, kHalfBox);
  box.pose = {{0, 0, 5.1 * kMm}, {1, 0, 0, 0}};
  box.shell.emplace();
  box.shell->points.emplace();
  Sampler sampler(sampling);
  sampler.face(*box.shell->points, {0, 0, -kHalfBox.z}, {kHalfBox.x, 0, 0}, {0, kHalfBox.y, 0}, nu,
               nv, {0, 0, 1});
  box.shell->bake.levels = 5;
  scene.bodies.push_back(box);

  HandPath hand(box.pose);
  hand.wait(0.05).move_by({0, 0, -15 * kMm}, 40 * kMm).wait(0.5);
  scene.hands.push_back(path_hand("box", hand.rows()));
  // The small plate is 2 mm thick: a point past its middle is pushed out on the other side.
  scene.verdict.forbidden.push_back(
      {{10 * kMm, -12 * kMm, -30 * kMm}, {30 * kMm, 12 * kMm, -1.2 * kMm}});
}

void add_plate(Scene& scene, const char* name, double x0, double x1, double y0, double y1) {
  scene.bodies.push_back(obstacle(name, box_mesh({x0, y0, -2 * kMm}, {x1, y1, 0}), kMm));
}
void add_plate(Scene& scene, const char* name, double x0, double x1, double half_y) {
  add_plate(scene, name, x0, x1, -half_y, half_y);
}

}  // namespace

Scene box_on_plates(const Sampling& sampling) {
  Scene scene = common_scene(
      "box-on-plates",
      "A box of 40 x 20 x 10 mm is pressed 10 mm past two plates, 2 mm thick: one under a third of "
      "it (960 points), one of 1.5 x 9 mm under its far end (54 points). Forbidden: below that "
      "end's plate.");
  scene.contact.epsilon_normal = 0.01;  // coplanar contacts are all that is to be merged
  add_plate(scene, "large", -20 * kMm, -8 * kMm, 11 * kMm);
  add_plate(scene, "small", 17 * kMm, 18.5 * kMm, 4.5 * kMm);
  press_box(scene, sampling, 80, 40);
  return scene;
}

Scene box_on_plates_share(double share) {
  Scene scene = common_scene(
      "box-on-plates-share",
      "A box of 40 x 20 x 10 mm is pressed 10 mm past two plates of 5 mm, 2 mm thick, under its "
      "ends; one is narrower. Forbidden: below that end's plate.");
  scene.contact.epsilon_normal = 0.01;
  scene.coupling.rotational_stiffness = 0.05;
  scene.coupling.max_torque = 0.5;
  add_plate(scene, "large", -20 * kMm, -15 * kMm, 11 * kMm);
  // The box has 40 x 20 points, one in every square millimetre: five contacts a row, at y = +-0.5,
  // +-1.5, ... mm. The plate's edges lie between two rows, and its field must have an inside.
  const int contacts = std::max(1, static_cast<int>(std::lround(100 * share)));
  if (contacts > 5) {
    const int pairs = std::max(1, static_cast<int>(std::lround(10 * share)));
    const int per_row = static_cast<int>(std::lround(contacts / (2.0 * pairs)));
    add_plate(scene, "small", (20 - per_row) * kMm, 20 * kMm, -pairs * kMm, pairs * kMm);
  } else {
    // Part of one row touches a plate 1 mm wide. A field of 1 mm would have samples on both sides
    // of it and none inside. The voxel is 0.25 mm instead; lengths counted in voxels are scaled so
    // that they stay the same in metres.
    add_plate(scene, "small", (20 - contacts) * kMm, 20 * kMm, 0, kMm);
    const double voxel = 0.25 * kMm;
    for (SceneBody& plate : scene.bodies) plate.field->bake.voxel_size = voxel;
    scene.contact.torque_length = kMm;
    scene.contact.margin_voxels *= kMm / voxel;
    scene.contact.cluster_voxels *= kMm / voxel;
    scene.coupling.max_force = 5;
  }
  press_box(scene, Sampling{}, 40, 20);
  return scene;
}

Scene box_on_plates() { return box_on_plates(Sampling{}); }

}  // namespace h6::io
