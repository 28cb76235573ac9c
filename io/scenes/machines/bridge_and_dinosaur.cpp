// SPDX-License-Identifier: Apache-2.0
// bridge_and_dinosaur.cpp - an elastic bridge, fixed at both ends, and a rigid dinosaur that a hand
// presses on it: the sizes of Fig. 14 of Xu & Barbic 2016, with shapes of our own.
#include <algorithm>
#include <cmath>

#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"
#include "io/scenes/machines/hex_body.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kLength = 400, kWidth = 72;         // of the bridge, along x and y [mm]
constexpr double kCrown = 8, kEnd = 60, kRise = 25;  // thickness in the middle and at the ends [mm]
constexpr double kParapet = 12;                      // height above the roadway [mm]
constexpr int kAlong = 80, kAcross = 12, kThrough = 4;  // cells of the roadway
constexpr int kParapetCells = 2;
constexpr double kYoung = 1e6, kPoisson = 0.4, kDensity = 1000;  // a soft rubber
constexpr double kVoxel = 0.75;                                  // of the dinosaur's field [mm]
constexpr double kRoadway = kEnd + kRise;                        // height of the crown [mm]

using Place = HexBody::Place;  // along, across, up

// A corner of the cells [m].
h6Vec3 corner(const Place& at) {
  const double u = 2.0 * at[0] / kAlong - 1;
  const double top = kEnd + kRise * (1 - u * u), thick = kCrown + (kEnd - kCrown) * u * u;
  const int layers = std::min(at[2], kThrough);
  const double z =
      top - thick * (kThrough - layers) / kThrough + kParapet * (at[2] - layers) / kParapetCells;
  return kMm * h6Vec3{0.5 * kLength * u, kWidth * (double(at[1]) / kAcross - 0.5), z};
}

// A roadway with parapets, fixed at both ends.
HexBody bridge_body() {
  HexBody out;
  out.cells = {kAlong, kAcross, kThrough + kParapetCells};
  out.split = 3;  // 59,000 triangles
  out.material = {"rubber", kYoung, kPoisson, kDensity};
  out.at = corner;
  out.solid = [](const Place& c) { return c[2] < kThrough || c[1] == 0 || c[1] == kAcross - 1; };
  out.fixed = [](const Place& at) { return at[0] == 0 || at[0] == kAlong; };
  return out;
}

// Four legs on z = 0, a body with a tail and a long neck, a head.
Mesh dinosaur_mesh() {
  Assembly a(kMm * kVoxel, 1);
  const Line spine = smooth({{-95, 0, 34},
                             {-60, 0, 38},
                             {-30, 0, 44},
                             {0, 0, 47},
                             {26, 0, 46},
                             {44, 0, 58},
                             {56, 0, 80},
                             {66, 0, 100},
                             {76, 0, 106}},
                            2);
  const double length = line_length(spine);
  const auto thickness = [&](double s) {
    const double t = s / length;  // 0 at the tip of the tail, 1 at the head
    const double body = std::exp(-std::pow((t - 0.4) / 0.16, 2));
    return 1.5 + 3.5 * std::min(1.0, 3 * t) + 13 * body;
  };
  a.add("dinosaur", rod(spine, thickness, 96));
  a.add("dinosaur", rod(
                        smooth({{68, 0, 105}, {78, 0, 106}, {92, 0, 101}}, 2),
                        [](double s) { return 8 - 0.15 * s; }, 64));
  for (const double x : {-24.0, 24.0})
    for (const double y : {-13.0, 13.0})
      a.add("dinosaur",
            rod(
                smooth({{x, y, 0}, {0.95 * x, 0.95 * y, 14}, {0.85 * x, 0.7 * y, 42}}, 2),
                [](double s) { return 7.5 - 2 * std::exp(-std::pow(s / 12 - 1, 2)); }, 48));
  return a.sound(56192);
}

Path dinosaur_path(const h6Pose& start) {
  HandPath hand(start);
  hand.wait(0.1).move_by({0, 0, -16 * kMm}, 0.08).wait(0.6);
  hand.move_by({30 * kMm, 0, 0}, 0.06).move_by({-60 * kMm, 0, 0}, 0.06).wait(0.3);
  hand.go_to({hand.pose().p, from_axes({std::cos(0.5), std::sin(0.5), 0},
                                       {-std::sin(0.5), std::cos(0.5), 0}, {0, 0, 1})},
             0.4)
      .wait(0.3);
  return hand.move_by({0, 0, 26 * kMm}, 0.3).wait(1).rows();
}

}  // namespace

Scene bridge_and_dinosaur() {
  Scene scene = common_scene(
      "bridge-and-dinosaur",
      "A rigid dinosaur of 56,192 triangles is pressed on a rubber bridge that bends by 20 modes "
      "and carries the points, dragged along it, turned, and lifted off at once.");
  scene.bodies.push_back(bending("bridge", bridge_body(), 85018));
  add_led(scene, obstacle("dinosaur", dinosaur_mesh(), kMm * kVoxel), 0.2,
          dinosaur_path({{0, 0, (kRoadway + 4) * kMm}, {1, 0, 0, 0}}));
  return scene;
}

}  // namespace h6::io
