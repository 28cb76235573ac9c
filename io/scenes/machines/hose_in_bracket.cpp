// SPDX-License-Identifier: Apache-2.0
// hose_in_bracket.cpp - a rubber hose goes through the eye of a bracket, which then bends it.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/assembly.h"
#include "io/scenes/list.h"
#include "io/scenes/machines/hex_body.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kLength = 180, kOuter = 6, kInner = 4;  // of the hose, along x from 0 [mm]
constexpr int kAlong = 72, kAround = 24;                 // cells
constexpr double kYoung = 5e7, kPoisson = 0.45, kDensity = 1100;
constexpr double kEye = 6.4, kLip = 3;  // the bracket's eye, and the rounding of its rim [mm]
constexpr double kRing = 16;            // outer radius of the ring around it [mm]
constexpr double kVoxel = 0.25;         // of the bracket's field [mm]

// Fixed at x = 0.
HexBody hose_body() {
  HexBody out;
  out.cells = {kAlong, kAround, 1};
  out.closed = true;
  out.split = 2;
  out.material = {"rubber", kYoung, kPoisson, kDensity};
  out.at = [](const HexBody::Place& c) {
    const double angle = -2 * std::numbers::pi * c[1] / kAround, r = c[2] ? kOuter : kInner;
    return kMm * h6Vec3{kLength * c[0] / kAlong, r * std::cos(angle), r * std::sin(angle)};
  };
  out.fixed = [](const HexBody::Place& c) { return c[0] == 0; };
  return out;
}

// A ring around the x axis with a round rim, on a foot.
Mesh bracket_mesh() {
  Profile profile;
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = std::numbers::pi * (double(i) / kSteps - 0.5);
    profile.push_back({kEye + kLip * (1 - std::cos(t)), kLip * std::sin(t)});
  }
  profile.push_back({kRing, kLip});
  profile.push_back({kRing, -kLip});
  Assembly a(kMm * kVoxel, 1);
  a.add("bracket", revolve(profile, 96, Ends::joined), facing({0, 0, 0}, {1, 0, 0}));
  a.add("bracket", box({-kLip, -8, -34}, {kLip, 8, -0.5 * (kEye + kLip + kRing)}));
  return a.sound(a.triangles());
}

// Over the free end, on along the hose, aside, on, back and off.
Path bracket_path(const h6Pose& start) {
  HandPath hand(start);
  hand.wait(0.1).move_by({-70 * kMm, 0, 0}, 0.1).wait(0.5);
  hand.move_by({0, 8 * kMm, 12 * kMm}, 0.05).wait(0.5);
  hand.move_by({-30 * kMm, 0, 0}, 0.1).wait(0.5);
  hand.move_by({0, -16 * kMm, 0}, 0.05).wait(0.5);
  hand.move_by({0, 8 * kMm, -12 * kMm}, 0.05).wait(0.5);
  return hand.move_by({100 * kMm, 0, 0}, 0.1).wait(0.5).rows();
}

}  // namespace

Scene hose_in_bracket() {
  Scene scene = common_scene(
      "hose-in-bracket",
      "A rubber hose that bends by 20 modes goes through the eye of a bracket, which slides along "
      "it, bends it aside and leaves it again.");
  scene.bodies.push_back(bending("hose", hose_body(), 30000));
  add_led(scene, obstacle("bracket", bracket_mesh(), kMm * kVoxel), 0.1,
          bracket_path({{(kLength + 10) * kMm, 0, 0}, {1, 0, 0, 0}}));
  return scene;
}

}  // namespace h6::io
