// SPDX-License-Identifier: Apache-2.0
// scenes.cpp - the industrial inputs as scenes: the hand leads a part to its place and away again.
#include "io/scenes/industrial/engine_bay.h"
#include "io/scenes/industrial/landing_gear.h"
#include "io/scenes/list.h"

namespace h6::io {
namespace {

using industrial::Frame;

h6Pose pose_of(const Frame& frame) { return {kMm * frame.o, from_axes(frame.x, frame.y, frame.z)}; }

struct Fit {
  Frame seat;        // where the part belongs
  h6Vec3 back, out;  // the way back: off its mating face, then out of the assembly [mm]
  double lever;      // the part's radius, for torques [m]
  std::size_t points;
};

// The hand brings the part to 3 mm before its seat, waits, and takes it back.
Scene fit_scene(const std::string& name, const std::string& about, const std::string& where,
                Mesh soup, const std::string& what, Mesh mesh, double voxel, const Fit& fit) {
  Scene scene = common_scene(name, about);
  // The largest force is that of half a voxel of penetration; torques follow from the part's size.
  scene.coupling.rotational_stiffness = scene.coupling.stiffness * fit.lever * fit.lever;
  scene.coupling.max_torque = scene.contact.stiffness * 0.5 * voxel * fit.lever;

  SceneBody obstacles = obstacle(where, std::move(soup), 0);
  obstacles.field->bake.voxels = 1024;
  scene.bodies.push_back(std::move(obstacles));

  const h6Pose seat = pose_of(fit.seat);
  const double gap = 3 * kMm;
  SceneBody part;
  part.name = what;
  part.pose = {seat.p + kMm * (fit.back + fit.out), seat.q};
  part.shell.emplace();
  part.shell->mesh_data = std::move(mesh);
  part.shell->bake.points = fit.points;
  part.shell->bake.levels = 7;
  HandPath hand(part.pose);
  scene.bodies.push_back(std::move(part));

  constexpr double kFast = 0.1, kSlow = 0.05;  // [m/s]
  const h6Vec3 out = kMm * fit.out;
  const h6Vec3 back = kMm * fit.back - gap * unit(fit.back);
  hand.wait(0.3).move_by(-1.0 * out, kFast).wait(0.1).move_by(-1.0 * back, kSlow).wait(0.4);
  hand.move_by(back, kSlow).move_by(out, kFast).wait(0.5);
  scene.hands.push_back(path_hand(what, hand.rows()));
  return scene;
}

}  // namespace

Scene engine_bay() {
  return fit_scene("engine-bay",
                   "A starter motor of 18,580 triangles is brought from below to its flange on the "
                   "bell housing, and back. The engine bay is a soup of 505,276 triangles: open "
                   "sheets, missing, doubled and inside-out triangles, wires two voxels thick.",
                   "bay", make_engine_bay().mesh, "starter", make_starter_motor(),
                   kMm * industrial::kBayVoxel,
                   {industrial::starter_seat(), {-56, 0, 0}, {0, 0, -180}, 0.08, 56823});
}

Scene landing_gear() {
  return fit_scene(
      "landing-gear",
      "A retraction actuator of 25,191 triangles is lifted between its two forks, and "
      "lowered again. Gear and bay are a soup of 1,789,551 triangles: skins and ribs "
      "without thickness, missing, doubled and inside-out triangles, wires two voxels "
      "thick.",
      "gear", make_landing_gear().mesh, "actuator", make_actuator(), kMm * industrial::kGearVoxel,
      {industrial::actuator_seat(), -90 * industrial::actuator_seat().y, {0, 0, -140}, 0.2, 38148});
}

}  // namespace h6::io
