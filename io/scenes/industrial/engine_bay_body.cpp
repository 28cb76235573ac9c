// SPDX-License-Identifier: Apache-2.0
// engine_bay_body.cpp - the car's body around the engine: sheets without thickness, rails, tanks,
// battery.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/engine_bay.h"

namespace h6::io::industrial {
namespace {

constexpr double kSide = kBayWidth / 2;

void add_firewall(Assembly& a) {
  // The firewall with its openings and pressed beads.
  Outline wall{rectangle(kBayWidth, 470, 60, 8, {0, 325}), {}};
  wall.holes = {circle(46, 48, {-290, 430}),   circle(24, 32, {-130, 300}),
                circle(17, 28, {60, 420}),     circle(17, 28, {110, 420}),
                circle(22, 32, {250, 380}),    rectangle(150, 60, 20, 6, {200, 490}),
                slot(60, 12, {-200, 200}, 0.4)};
  a.add("firewall", flat(wall), kFront * at(0, 0, -375), Kind::sheet);
  for (const double z : {150.0, 250.0, 345.0})
    a.add("firewall bead",
          sheet(80, 6,
                [&](double u, double v) {
                  const double c = std::cos(std::numbers::pi * (v - 0.5));
                  return h6Vec3{-380 + 760 * u, 375 - 7 * c, z + 26 * (v - 0.5)};
                }),
          {}, Kind::sheet);
}

// Adds the fender apron with the wheel's arch, the strut tower and a rail of hat section. `side` is
// -1 or 1.
void add_side(Assembly& a, double side) {
  a.add("fender apron",
        sheet(60, 24,
              [&](double u, double v) {
                const double y = -370 + 740 * u, z = 190 + 340 * v;
                const double arch =
                    std::max(0.0, 1 - std::pow((y - 150) / 190, 2)) * std::max(0.0, 1 - v * 1.4);
                return h6Vec3{side * (kSide - 26 * v * v - 70 * arch), y, z};
              }),
        {}, Kind::sheet);
  a.add(
      "strut tower",
      revolve(
          {{96, 215}, {94, 330}, {90, 420}, {84, 440}, {74, 448}, {62, 450}, {60, 455}, {26, 455}},
          72, Ends::open),
      at(side * 350, 150, 0), Kind::sheet);
  const Frame top = at(side * 350, 150, 455);
  a.add("strut mount",
        revolve({{0, -10}, {44, -10}, {46, 0}, {30, 8}, {16, 10}, {16, 16}, {0, 16}}, 56), top);
  a.add("strut nut", nut(14), top * at(0, 0, 15));
  a.add("strut rod", cylinder(7, -60, 40, 24), top);
  for (int i = 0; i < 3; ++i) {
    const Frame stud = rolled(top, 2 * std::numbers::pi * i / 3) * at(52, 0, 0);
    a.add("strut stud", hex_bolt(8, 24), stud * facing({0, 0, -2}, {0, 0, -1}));
    a.add("strut stud nut", nut(9), stud * at(0, 0, 1));
  }
  a.add("coil spring", spring(62, 6.5, 34, 4.5), at(side * 350, 150, 240));
  const Polygon hat = {{-70, 0}, {-38, 0}, {-32, 70}, {32, 70}, {38, 0}, {70, 0}};
  a.add(
      "frame rail",
      sheet(40, 5,
            [&](double u, double v) {
              const P2 p = hat[static_cast<std::size_t>(std::lround(5 * v))];
              const double rise = 40 * std::pow(std::max(0.0, u - 0.6) / 0.4, 2);
              return h6Vec3{side * (kSide - 2 - 0.9 * p.y), -372 + 745 * u, 185 - rise + 0.8 * p.x};
            }),
      {}, Kind::sheet);
  for (int i = 0; i < 26; ++i)
    for (const double z : {-48.0, 48.0})
      a.add("rail rivet", rivet(6),
            facing({side * (kSide - 2), -355 + 27.5 * i,
                    185 + z - 40 * std::pow(std::max(0.0, (i * 27.5 + 17) / 745 - 0.6) / 0.4, 2)},
                   {-side, 0, 0}));
}

// Closed box sections, with slotted brackets on the front one.
void add_cross_members(Assembly& a) {
  a.add("front cross member", block(820, 46, 44, 8, 3), at(0, -345, 18));
  a.add("upper cross member", block(760, 34, 26, 8, 3), at(0, -350, 500));
  a.add("rear cross member", block(780, 80, 34, 12, 4), at(0, 300, 62));
  for (const double x : {-250.0, -90.0, 90.0, 250.0}) {
    Outline bracket{rectangle(60, 90, 8, 4, {x, 70}), {}};
    bracket.holes = {slot(18, 5, {x, 92}, std::numbers::pi / 2), circle(6, 20, {x - 16, 50}),
                     circle(6, 20, {x + 16, 50})};
    a.add("radiator bracket", extrude(bracket, 318, 322), kFront);
    for (const double dx : {-16.0, 16.0})
      add_bolt(a, "radiator bracket bolt", facing({x + dx, -322, 50}, {0, -1, 0}), 9, 22);
  }
}

// Rubber blocks between two slotted brackets, gussets.
void add_engine_mounts(Assembly& a) {
  for (const double x : {-260.0, 330.0}) {
    a.add("engine mount", revolve({{0, 0}, {40, 0}, {34, 10}, {34, 34}, {40, 44}, {0, 44}}, 48),
          at(x, 110, 84));
    Outline arm{hull({{0, 0, 34}, {x < 0 ? 60.0 : -80.0, -10, 26}}, 48), {}};
    arm.holes = {circle(8, 24), slot(14, 5, {x < 0 ? 48.0 : -62.0, -8}, 0.3)};
    a.add("engine mount arm", extrude(arm, 128, 138), at(x, 110, 0));
    add_bolt(a, "engine mount bolt", at(x, 110, 138), 13, 50);
    a.add("engine mount gusset", extrude({{{-30, 0}, {30, 0}, {0, 40}}, {}}, -3, 3),
          at(x, 110, 84) * facing({0, 30, -30}, {1, 0, 0}, {0, 0, 1}));
  }
}

// A tank has two closed surfaces, so that its wall is modelled without joining them.
void add_tank(Assembly& a, const std::string& name, const Piece& outer, const Piece& inner,
              const Frame& frame) {
  a.add(name + " inner wall", inner, frame);
  a.add(name + " outer wall", outer, frame);
}

void add_tanks(Assembly& a) {
  // The coolant tank: a ball welded from two halves, hence finely tessellated.
  const auto ball = [](double r, double h) {
    Profile profile;
    for (int i = 0; i <= 36; ++i) {
      const double t = -std::numbers::pi / 2 + std::numbers::pi * i / 36;
      const double c = std::pow(std::max(0.0, std::cos(t)), 0.55), s = std::sin(t);
      profile.push_back(
          {i == 0 || i == 36 ? 0 : r * c, h * std::copysign(std::pow(std::abs(s), 0.7), s)});
    }
    return revolve(profile, 80);
  };
  const Frame coolant = at(320, 290, 470);
  add_tank(a, "coolant tank", ball(62, 54), ball(58.5, 50.5), coolant);
  a.leave_hole("coolant tank outer wall", {372, 260, 472}, 1);
  a.add("coolant tank seam", revolve({{60, -3}, {68, -3}, {68, 3}, {60, 3}}, 96, Ends::joined),
        coolant);
  a.add("coolant cap", extrude({gear(18, 21, 23.5), {}}, 50, 70), coolant);
  // Washer fluid and power steering.
  add_tank(a, "washer tank", block(90, 110, 200, 26, 14, 8),
           placed(block(83, 103, 193, 23, 11, 8), at(0, 0, 3.5)), at(-366, -15, 130));
  a.add("washer filler",
        revolve({{0, 318}, {16, 318}, {16, 400}, {22, 402}, {22, 414}, {0, 414}}, 40),
        at(-366, -15, 0));
  a.add("washer pump", revolve({{0, 0}, {13, 0}, {13, 46}, {9, 50}, {0, 50}}, 36),
        at(-316, -62, 140));
  const auto can = [](double r, double z0, double z1) {
    Profile profile = {{0, z0}};
    for (int i = 0; i <= 20; ++i) profile.push_back({r, z0 + (z1 - z0) * i / 20});
    profile.push_back({0, z1});
    return revolve(profile, 72);
  };
  const Frame steering = at(-330, 30, 420);
  add_tank(a, "steering reservoir", can(36, 0, 80), can(32.5, 3.5, 76.5), steering);
  a.leave_hole("steering reservoir outer wall", {-330, -6, 460}, 2);
  a.add("steering cap", extrude({gear(16, 24, 26), {}}, 78, 94), steering);
}

void add_electrics(Assembly& a) {
  const Frame battery = at(340, -225, 262);
  a.add("battery", block(160, 200, 165, 6, 2.5), battery);
  a.add("battery lid", block(166, 206, 16, 8, 3), battery * at(0, 0, 160));
  for (int i = 0; i < 6; ++i)
    a.add("battery cell cap", extrude({gear(20, 10, 11), {}}, 174, 180),
          battery * at(0, -78 + 31.0 * i, 0));
  for (const double y : {-76.0, 76.0}) {
    a.add("battery terminal", revolve({{0, 170}, {9.5, 170}, {8.5, 192}, {0, 192}}, 32),
          battery * at(56, y, 0));
    Outline clamp{hull({{0, 0, 16}, {-34, 0, 9}}, 40), {circle(9.2, 28)}};
    a.add("battery clamp", extrude(clamp, 178, 190), battery * at(56, y, 0));
    add_bolt(a, "battery clamp bolt", battery * at(32, y, 190), 7, 20);
  }
  a.add(
      "battery tray",
      extrude({rectangle(180, 226, 10, 4), {slot(120, 14, {0, 50}, 0), slot(120, 14, {0, -50}, 0)}},
              -6, -1),
      battery);
  Outline bridge{hull({{0, 0, 12}, {170, 0, 12}}, 24),
                 {circle(5, 18, {0, 0}), circle(5, 18, {170, 0})}};
  a.add("battery hold down", extrude(bridge, 178, 182), battery * at(-85, 0, 0));
  for (const double x : {-85.0, 85.0}) {
    a.add("battery rod", hex_bolt(8, 180), battery * at(x, 0, 183));
  }
  // Fuse box: relays and fuses under an open lid.
  const Frame box_frame = at(372, -40, 330);
  a.add("fuse box", block(120, 150, 60, 10, 4), box_frame);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 7; ++j)
      a.add(j < 2 ? "relay" : "fuse",
            block(j < 2 ? 24 : 20, j < 2 ? 24 : 8, j < 2 ? 26 : 14, 2, 1, 2),
            box_frame * at(-41 + 27.0 * i, -56 + (j < 2 ? 27.0 * j : 24.0 + 17 * (j - 1)), 58));
  // Brake: booster of two shells, master cylinder, reservoir, pressure unit.
  const Frame booster = facing({-290, 372, 430}, {0, -1, 0}, {0, 0, 1});
  a.add("brake booster",
        revolve({{0, 0},
                 {60, 0},
                 {92, 14},
                 {104, 36},
                 {108, 40},
                 {108, 46},
                 {104, 48},
                 {100, 70},
                 {70, 92},
                 {40, 98},
                 {0, 98}},
                88),
        booster);
  a.add("master cylinder",
        revolve({{0, 96}, {24, 96}, {24, 110}, {17, 112}, {17, 190}, {12, 196}, {0, 196}}, 48),
        booster);
  a.add("brake reservoir", block(60, 110, 52, 14, 6), at(-290, 226, 452));
  a.add("brake cap", extrude({gear(16, 19, 21), {}}, 500, 518), at(-290, 200, 0));
  a.add("brake pressure unit", block(90, 80, 70, 5, 2), at(372, 305, 300));
  for (int i = 0; i < 6; ++i)
    a.add("brake fitting", hex_bolt(9, 12), at(342 + 30.0 * (i % 3), 290 + 30.0 * (i / 3), 371));
  for (const double x : {-40.0, 40.0})
    a.add("booster stud nut", nut(8), facing({-290 + x, 274, 430}, {0, -1, 0}));
  // Air filter box, its two halves clipped together.
  a.add("air filter box", block(130, 190, 66, 22, 8), at(-372, -225, 300));
  a.add("air filter lid", block(126, 186, 62, 20, 14), at(-372, -225, 372));
  a.add("air filter rim", extrude({rectangle(142, 202, 26, 6), {}}, 364, 374), at(-372, -225, 0));
  for (int i = 0; i < 8; ++i)
    a.add("air filter rib", box({-434 + 17.0 * i, -300, 430}, {-431 + 17.0 * i, -150, 438}));
  for (const double y : {-290.0, -160.0})
    a.add("air filter clip",
          rod(smooth({{-300, y, 355}, {-296, y, 365}, {-297, y, 380}, {-303, y, 392}}, 2), 2, 12));
}

}  // namespace

void add_body_shell(Assembly& a) {
  add_firewall(a);
  for (const double side : {-1.0, 1.0}) add_side(a, side);
  add_cross_members(a);
  add_engine_mounts(a);
  add_tanks(a);
  add_electrics(a);
}

}  // namespace h6::io::industrial
