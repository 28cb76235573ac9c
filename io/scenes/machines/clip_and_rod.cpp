// SPDX-License-Identifier: Apache-2.0
// clip_and_rod.cpp - a rod pushed into a clip that opens, snaps behind it and holds it.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"
#include "io/scenes/machines/hex_body.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kRod = 10, kRodLength = 24;  // radius, length along y [mm]
constexpr double kVoxel = 0.25;               // of the rod's field [mm]
// The clip's middle line: an arc around the rod, open below, and two lips that lead the rod in.
constexpr double kPlay = 0.1, kThick = 2, kWidth = 12;   // [mm]
constexpr double kArc = 110, kLip = 85, kLipRadius = 4;  // half the arc, a lip [degrees], [mm]
constexpr int kAlong = 72, kAcross = 6, kThrough = 3;    // cells
// The arms open for about 1 N, a quarter of what half a voxel of contact gives.
constexpr double kYoung = 4e8, kPoisson = 0.4, kDensity = 950;
constexpr double kFixed = 20;  // of the arc, on each side of its top [degrees]

constexpr double rad(double degrees) { return degrees * std::numbers::pi / 180; }

// A section of the clip: its place in x and z [mm], and the direction of the middle line there, as
// the angle from +x towards -z. `s` runs from -1 to 1 along the middle line.
struct Section {
  double x, z, turn;
};
Section section(double s) {
  constexpr double radius = kRod + kPlay + 0.5 * kThick, end = rad(kArc);
  const double arc = radius * end, along = std::fabs(s) * (arc + kLipRadius * rad(kLip));
  Section out{radius * std::sin(along / radius), radius * std::cos(along / radius), along / radius};
  if (along > arc) {  // the lip turns the other way
    out.turn = end - (along - arc) / kLipRadius;
    out.x = radius * std::sin(end) + kLipRadius * (std::sin(end) - std::sin(out.turn));
    out.z = radius * std::cos(end) - kLipRadius * (std::cos(out.turn) - std::cos(end));
  }
  if (s < 0) out.x = -out.x, out.turn = -out.turn;
  return out;
}

HexBody clip_body() {
  HexBody out;
  out.cells = {kAlong, kAcross, kThrough};
  out.split = 2;
  out.material = {"polyethylene", kYoung, kPoisson, kDensity};
  out.at = [](const HexBody::Place& c) {
    const Section at = section(2.0 * c[0] / kAlong - 1);
    const double outward = kThick * (double(c[2]) / kThrough - 0.5);
    return kMm * h6Vec3{at.x + outward * std::sin(at.turn), kWidth * (double(c[1]) / kAcross - 0.5),
                        at.z + outward * std::cos(at.turn)};
  };
  out.fixed = [](const HexBody::Place& c) {
    const Section at = section(2.0 * c[0] / kAlong - 1);
    return c[2] == kThrough && at.z > 0 && std::fabs(at.turn) < rad(kFixed);
  };
  return out;
}

Mesh rod_mesh() {
  Assembly a(kMm * kVoxel, 1);
  a.add("rod", cylinder(kRod, -0.5 * kRodLength, 0.5 * kRodLength, 96),
        facing({0, 0, 0}, {0, 1, 0}));
  return a.sound(a.triangles());
}

// The rod goes in, is pulled 1 mm back, and leaves between the lips.
Path rod_path(const h6Pose& start) {
  HandPath hand(start);
  hand.wait(0.1).move_by({0, 0, -start.p.z}, 0.08).wait(0.5);
  hand.move_by({0, 0, -1 * kMm}, 0.02).wait(0.5).move_by({0, 0, 1 * kMm}, 0.02).wait(0.3);
  return hand.move_by({0, 0, start.p.z}, 0.08).wait(1).rows();
}

}  // namespace

Scene clip_and_rod() {
  Scene scene = common_scene(
      "clip-and-rod",
      "A rod is pushed into a clip that bends by 20 modes: the lips give way and snap behind it. "
      "The clip holds it against a small pull, and lets it go at a greater one.");
  scene.contact.stiffness = 4e4;
  scene.bodies.push_back(bending("clip", clip_body(), 20000));
  add_led(scene, obstacle("rod", rod_mesh(), kMm * kVoxel), 0.05,
          rod_path({{0, 0, -26 * kMm}, {1, 0, 0, 0}}));
  return scene;
}

}  // namespace h6::io
