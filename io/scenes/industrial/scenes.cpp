// SPDX-License-Identifier: Apache-2.0
// scenes.cpp - the industrial inputs as scenes: the hand leads a part to its seat, forces it
// against what stands around it, and takes it away again.
#include <algorithm>

#include "io/scenes/industrial/engine_bay.h"
#include "io/scenes/industrial/forced_path.h"
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

Fit starter_fit() { return {industrial::starter_seat(), {-56, 0, 0}, {0, 0, -180}, 0.08, 56823}; }
Fit actuator_fit() {
  return {
      industrial::actuator_seat(), -90 * industrial::actuator_seat().y, {0, 0, -140}, 0.2, 38148};
}

constexpr double kFast = 0.1, kSlow = 0.05;  // [m/s]
constexpr double kGap = 3 * kMm;             // the way in ends this far from the seat

h6Pose outside_of(const Fit& fit) {
  const h6Pose seat = pose_of(fit.seat);
  return {seat.p + kMm * (fit.back + fit.out), seat.q};
}

h6Vec3 last_move_in(const Fit& fit) { return kGap * unit(fit.back) - kMm * fit.back; }

HandPath way_in(const Fit& fit) {
  HandPath hand(outside_of(fit));
  hand.wait(0.3).move_by(-kMm * fit.out, kFast).wait(0.1).move_by(last_move_in(fit), kSlow);
  hand.wait(0.25);
  return hand;
}

// From the end of the way in: on the mating face and 6 mm beyond, to either side, turned, and twice
// straight out through whatever stands there.
void force(HandPath& hand, const Fit& fit) {
  const h6Pose here = hand.pose();
  const h6Vec3 in = -1.0 * unit(fit.back), out = unit(fit.out), side = cross(in, out);
  const auto to = [&](const h6Vec3& millimetres, const h6Vec3& turn) {
    const h6Vec3 p = here.p + kMm * millimetres;
    hand.go_to({p, product(turn_by(turn), here.q)}, std::max(0.2, norm(p - hand.pose().p) / kFast));
    hand.wait(0.6);  // the part settles, and what it does then is judged
  };
  const h6Vec3 straight{};
  to(9 * in, straight);
  to(9 * in + 20 * side, straight);
  to(9 * in - 20 * side, straight);
  to(9 * in, 0.3 * in);
  to(straight, straight);
  to(60 * out, straight);
  to(60 * out + 30 * side, 0.3 * side);
  to(straight, straight);
  to(-25 * in + 60 * out - 40 * side, 0.3 * out);
  to(-25 * in, straight);
  to(straight, straight);
}

Scene fit_scene(const std::string& name, const std::string& about, const std::string& where,
                Mesh soup, const std::string& what, Mesh mesh, double voxel, const Fit& fit) {
  Scene scene = common_scene(name, about);
  // The largest force is that of half a voxel of penetration; torques follow from the part's size.
  scene.coupling.rotational_stiffness = scene.coupling.stiffness * fit.lever * fit.lever;
  scene.coupling.max_torque = scene.contact.stiffness * 0.5 * voxel * fit.lever;

  SceneBody obstacles = obstacle(where, std::move(soup), 0);
  obstacles.field->bake.voxels = 1024;
  scene.bodies.push_back(std::move(obstacles));

  SceneBody part;
  part.name = what;
  part.pose = outside_of(fit);
  part.shell.emplace();
  part.shell->mesh_data = std::move(mesh);
  part.shell->bake.points = fit.points;
  part.shell->bake.levels = 7;
  scene.bodies.push_back(std::move(part));

  HandPath hand = way_in(fit);
  force(hand, fit);
  hand.move_by(-1.0 * last_move_in(fit), kSlow).move_by(kMm * fit.out, kFast).wait(0.5);
  scene.hands.push_back(path_hand(what, hand.rows()));
  return scene;
}

}  // namespace

Path starter_way_in() { return way_in(starter_fit()).rows(); }
Path actuator_way_in() { return way_in(actuator_fit()).rows(); }

Scene engine_bay() {
  return fit_scene("engine-bay",
                   "A starter motor of 18,580 triangles is brought from below to its flange on the "
                   "bell housing, forced against it and straight out through what stands around, "
                   "and taken back. The engine bay is a soup of 505,276 triangles: open sheets, "
                   "missing, doubled and inside-out triangles, wires two voxels thick.",
                   "bay", make_engine_bay().mesh, "starter", make_starter_motor(),
                   kMm * industrial::kBayVoxel, starter_fit());
}

Scene landing_gear() {
  return fit_scene(
      "landing-gear",
      "A retraction actuator of 25,191 triangles is lifted between its two forks, forced against "
      "them and straight out through what stands around, and lowered again. Gear and bay are a "
      "soup of 1,789,551 triangles: skins and ribs without thickness, missing, doubled and "
      "inside-out triangles, wires two voxels thick.",
      "gear", make_landing_gear().mesh, "actuator", make_actuator(), kMm * industrial::kGearVoxel,
      actuator_fit());
}

}  // namespace h6::io
