// SPDX-License-Identifier: Apache-2.0
// nut_on_bolt.cpp - a nut screwed on a bolt: a helix of contacts that only lets it down as it
// turns.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kPitch = 4, kMajor = 10, kDepth = 2;     // of the bolt's right-handed thread [mm]
constexpr double kCrest = 0.8;                            // width of its crests [mm]
constexpr double kPlay = 0.25;                            // the nut's radius is so much larger [mm]
constexpr double kBolt = 24, kNut = 12, kNutRadius = 16;  // lengths, outer radius [mm]
constexpr double kNutVoxel = 0.25;                        // [mm]
// As many points around as rows in a pitch, so that the edges of the helix run through corners.
constexpr int kAround = 48;

// The bolt's radius at a height over the helix' own, in pitches.
double thread_radius(double turns) {
  const double from_crest = kPitch * std::fabs(turns - std::floor(turns) - 0.5);
  const double flank = (from_crest - 0.5 * kCrest) / (0.5 * kPitch - kCrest);
  return kMajor - kDepth * std::clamp(flank, 0.0, 1.0);
}

// Rings of a thread from z0 to z1; `bound` keeps a radius at a height inside a chamfer.
template <class Bound>
std::vector<Line> thread_rings(double z0, double z1, Bound&& bound) {
  const int rows = static_cast<int>(std::lround((z1 - z0) / kPitch * kAround));
  std::vector<Line> rings;
  for (int j = 0; j <= rows; ++j) {
    const double z = z0 + (z1 - z0) * j / rows;
    rings.emplace_back();
    for (int i = 0; i < kAround; ++i) {
      const double turn = double(i) / kAround, angle = 2 * std::numbers::pi * turn;
      const double r = bound(thread_radius(z / kPitch - turn), z);
      rings.back().push_back({r * std::cos(angle), r * std::sin(angle), z});
    }
  }
  return rings;
}

Line round(double radius, double z) {
  Line ring;
  for (const P2& p : circle(radius, kAround)) ring.push_back({p.x, p.y, z});
  return ring;
}

Mesh mesh_of(const char* name, const Piece& piece) {
  Assembly a(kMm * kNutVoxel, 1);
  a.add(name, piece);
  return a.sound(a.triangles());
}

// Its end is at z = 0. A chamfer leads a nut on, and another leaves no thin runout below.
Mesh bolt_mesh() {
  const auto chamfer = [](double r, double z) {
    return std::min(r, kMajor - kDepth - 0.3 + std::min(-z, kBolt + z));
  };
  return mesh_of("bolt", loft(thread_rings(-kBolt, 0, chamfer), Ends::capped));
}

// From z = 0 up, with a chamfer below.
Mesh nut_mesh() {
  const auto chamfer = [](double r, double z) {
    return std::max(r + kPlay, kMajor + kPlay + 0.3 - z);
  };
  std::vector<Line> rings = thread_rings(0, kNut, chamfer);
  rings.push_back(round(kNutRadius, kNut));
  rings.push_back(round(kNutRadius, 0));
  return mesh_of("nut", loft(rings, Ends::joined));
}

Path nut_path(const h6Pose& start) {
  HandPath hand(start);
  hand.wait(0.1);
  double angle = 0;
  const auto quarter = [&](double way, double seconds) {  // down, or up
    angle -= way * 0.5 * std::numbers::pi;
    const h6Vec3 p = hand.pose().p + h6Vec3{0, 0, -way * 0.25 * kPitch * kMm};
    hand.go_to({p, turn_by({0, 0, angle})}, seconds);
  };
  for (int i = 0; i < 12; ++i) quarter(1, 0.15);
  // The thread holds it against a pull, and against a push to the side.
  hand.wait(0.5).move_by({0, 0, 5 * kMm}, 0.05).wait(0.5).move_by({0, 0, -5 * kMm}, 0.05);
  hand.move_by({3 * kMm, 0, 0}, 0.05).wait(0.5).move_by({-3 * kMm, 0, 0}, 0.05);
  for (int i = 0; i < 12; ++i) quarter(-1, 0.15);
  return hand.wait(0.5).rows();
}

}  // namespace

Scene nut_on_bolt() {
  Scene scene = common_scene(
      "nut-on-bolt",
      "A nut is screwed on a bolt by three turns (pitch 4 mm, a quarter of a millimetre of play), "
      "pulled and pushed aside against the thread, and screwed off.");
  const double lever = kMajor * kMm;
  scene.coupling.rotational_stiffness = scene.coupling.stiffness * lever * lever;
  scene.coupling.max_torque = scene.contact.stiffness * 0.5 * kMm * kNutVoxel * lever;
  scene.bodies.push_back(obstacle("bolt", bolt_mesh(), kMm * kNutVoxel));
  SceneBody nut;
  nut.name = "nut";
  nut.pose = {{0, 0, kPitch * kMm}, {1, 0, 0, 0}};
  nut.shell.emplace();
  nut.shell->mesh_data = nut_mesh();
  nut.shell->bake.points = 8000;
  const Path path = nut_path(nut.pose);
  scene.hands.push_back(path_hand("nut", path));
  scene.verdict.target = path.back().pose;
  scene.verdict.tolerance = kMm, scene.verdict.tolerance_angle = 0.05;
  scene.bodies.push_back(std::move(nut));
  return scene;
}

}  // namespace h6::io
