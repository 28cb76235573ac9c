// SPDX-License-Identifier: Apache-2.0
// landing_gear_wheels.cpp - two wheels: tyres with tread, rims, stacks of brake discs.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/landing_gear.h"

namespace h6::io::industrial {
namespace {

constexpr double kAxle = 400;      // height
constexpr double kTyre = 385;      // outer radius
constexpr double kHalfTyre = 108;  // half of the tyre's width
constexpr double kRim = 215;

// A point of the tyre's section, which runs from bead to bead.
struct TyrePoint {
  double r, z, tread;  // tread: depth of the sipes here, 1 the full depth, 0 none
};
std::vector<TyrePoint> tyre_section() {
  std::vector<TyrePoint> out;
  const auto add = [&](double r, double z, double tread = 0) { out.push_back({r, z, tread}); };
  const auto wall = [&](double side, bool outward) {
    for (int k = 0; k <= 22; ++k) {
      const double t = (outward ? k : 22 - k) / 22.0, angle = std::numbers::pi * (0.06 + 0.66 * t);
      const double r = 300 - 96 * std::cos(angle) - (t > 0.9 ? (t - 0.9) * 30 : 0);
      const double rib = k == 9 || k == 12 ? 1.5 : 0;  // moulded rings
      add(r, side * (62 + (kHalfTyre - 62 + rib) * std::sin(angle)));
    }
  };
  wall(-1, true);
  const double first = std::abs(out.back().z), crown = out.back().r;
  constexpr int kRibs = 6;
  const double pitch = 2 * first / kRibs;
  const auto height = [&](double z) {
    return crown + (kTyre - crown) * (1 - std::pow(z / first, 2));
  };
  for (int i = 0; i < kRibs; ++i) {
    const double z = -first + pitch * i;
    for (const double f : {0.12, 0.3, 0.5, 0.7, 0.88})
      add(height(z + f * pitch), z + f * pitch, i == 0 || i == kRibs - 1 ? 1.0 : 0.45);
    if (i + 1 == kRibs) break;
    add(height(z + pitch) - 9, z + 0.93 * pitch);
    add(height(z + pitch) - 10, z + 1.0 * pitch);
    add(height(z + pitch) - 9, z + 1.07 * pitch);
  }
  wall(1, false);
  return out;
}

void add_tyre(Assembly& a, const Frame& wheel) {
  constexpr int kAround = 840;
  std::vector<Line> rings;
  for (const TyrePoint& p : tyre_section()) {
    Line ring;
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2 * std::numbers::pi * i / kAround;
      // Slanted sipes cut across the ribs; they repeat every seventh step.
      const int phase = (i + static_cast<int>(std::lround(p.z / 9)) + 700) % 7;
      const double r = p.r - (p.tread > 0 && phase < 2 ? 7 * p.tread : 0);
      ring.push_back({r * std::cos(angle), r * std::sin(angle), p.z});
    }
    rings.push_back(std::move(ring));
  }
  a.add("tyre", loft(rings, Ends::joined), wheel);
}

void add_rim(Assembly& a, const Frame& wheel) {
  for (const double side : {-1.0, 1.0}) {
    // The profile of one half: flange, tube well, web.
    Profile half;
    for (const P2& p : Profile{{kRim - 12, 4},
                               {kRim - 12, 62},
                               {kRim - 4, 72},
                               {kRim + 10, 76},
                               {kRim + 18, 82},
                               {kRim + 16, 90},
                               {kRim + 4, 90},
                               {kRim - 14, 84},
                               {kRim - 28, 66},
                               {kRim - 28, 4}})
      half.push_back({p.x, side * p.y});
    a.add("rim", revolve(half, 160, Ends::joined), wheel);
  }
  Outline web{circle(kRim - 10, 144), {circle(52, 72)}};
  add_bolt_circle(web, 118, 9, 24, 0, {0, 0}, 36);
  add_bolt_circle(web, 172, 18, 6.2, 0.1, {0, 0}, 20);
  a.add("wheel web", extrude(web, -2, 24), wheel);
  for (int i = 0; i < 18; ++i) {
    const Frame seat = rolled(wheel, 0.1 + 2 * std::numbers::pi * i / 18) * at(172, 0, 24);
    add_bolt(a, "tie bolt", seat, 11, 44);
    a.add("tie bolt nut", nut(11),
          rolled(wheel, 0.1 + 2 * std::numbers::pi * i / 18) * facing({172, 0, -2}, {0, 0, -1}));
  }
  for (int i = 0; i < 9; ++i)
    a.add("wheel spoke rib", box({58, -5, 20}, {kRim - 24, 5, 40}),
          rolled(wheel, 2 * std::numbers::pi * (i + 0.5) / 9));
  a.add("hub", revolve({{44, -20}, {62, -20}, {62, 60}, {54, 66}, {44, 66}}, 96, Ends::joined),
        wheel);
  a.add("hub cap", revolve({{0, 92}, {30, 91}, {46, 84}, {54, 70}, {56, 62}, {0, 62}}, 96), wheel);
  add_bolt_row(a, "hub cap bolt", wheel, circle(57, 60), 64, 40, 6, 16);
  a.add("inflation valve",
        rod(smooth({{kRim - 24, 0, 40}, {kRim - 40, 0, 60}, {kRim - 56, 0, 70}}, 4), 5, 20),
        rolled(wheel, 0.35));
}

void add_brake(Assembly& a, const Frame& wheel) {
  // Rotors (keyed to the rim) and stators (keyed to the torque tube) alternate; all have holes.
  for (int i = 0; i < 9; ++i) {
    const bool rotor = i % 2 == 1;
    const double z = -28 - 11.5 * i;
    Outline disc{rotor ? gear(18, 168, 178) : circle(162, 120), {}};
    disc.holes.push_back(rotor ? circle(88, 96) : gear(14, 74, 82));
    for (const double r : {104.0, 124.0, 144.0})
      add_bolt_circle(disc, r, 24, 3.4, (r + i) * 0.05, {0, 0}, 16);
    a.add(rotor ? "brake rotor" : "brake stator", extrude(disc, z - 9.2, z), wheel);
  }
  a.add("torque tube", revolve({{48, -150}, {73, -150}, {73, -22}, {48, -22}}, 96, Ends::joined),
        wheel);
  Outline plate{hull({{0, 0, 150}, {0, 60, 120}}, 96), {circle(52, 64)}};
  add_bolt_circle(plate, 84, 10, 5.4, 0.3, {0, 0}, 18);
  a.add("brake housing", extrude(plate, -152, -134), wheel);
  for (int i = 0; i < 8; ++i) {
    const Frame piston =
        rolled(wheel, 2 * std::numbers::pi * i / 8) * facing({124, 0, -152}, {0, 0, -1});
    a.add("brake piston", revolve({{0, -2}, {27, -2}, {27, 22}, {23, 27}, {0, 27}}, 56), piston);
    a.add("brake piston cap", extrude({gear(20, 15, 16.5), {}}, 27, 33), piston);
    a.add("adjuster pin", hex_bolt(8, 20),
          rolled(wheel, 2 * std::numbers::pi * (i + 0.5) / 8) * facing({136, 0, -152}, {0, 0, -1}));
  }
  add_bolt_row(a, "brake bolt", wheel * facing({0, 0, -152}, {0, 0, -1}), circle(84, 60), 0, 52, 10,
               30);
  for (int i = 0; i < 12; ++i)  // heat shield between rim and discs: sheets, overlapping
    a.add("heat shield",
          sheet(30, 24,
                [&](double u, double v) {
                  const double angle = 2 * std::numbers::pi * (i + 1.06 * u) / 12,
                               r = 182.5 + 1.2 * u;
                  return h6Vec3{r * std::cos(angle), r * std::sin(angle), -6 - 122 * v};
                }),
          wheel, Kind::sheet);
  for (const double z : {-40.0, -100.0})
    a.add("bearing",
          revolve({{43, z - 12}, {51, z - 12}, {51, z + 12}, {43, z + 12}}, 80, Ends::joined),
          wheel);
}

}  // namespace

void add_wheels(Assembly& a) {
  a.add("axle", revolve({{0, -372}, {36, -372}, {42, -364}, {42, 364}, {36, 372}, {0, 372}}, 96),
        facing({0, 0, kAxle}, {1, 0, 0}, {0, 1, 0}));
  for (const double side : {-1.0, 1.0}) {
    const Frame wheel = facing({side * 275, 0, kAxle}, {side, 0, 0}, {0, 1, 0});
    add_tyre(a, wheel);
    if (side > 0) a.leave_hole("tyre", {275 + 100, 0, kAxle + 300}, 8);
    add_rim(a, wheel);
    add_brake(a, wheel);
  }
}

}  // namespace h6::io::industrial
