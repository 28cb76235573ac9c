// SPDX-License-Identifier: Apache-2.0
// engine_bay_drive.cpp - the parts the engine drives: belt, accessories, clutch, gearbox, shafts.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/engine_bay.h"

namespace h6::io::industrial {
namespace {

constexpr double kBeltX = -264;
constexpr P2 kCrank = {50, 230};   // (y, z) of the crankshaft
constexpr P2 kShaft = {186, 104};  // (y, z) of the drive shafts, behind and below

struct Pulley {
  const char* name;
  double y, z, radius;
};
constexpr Pulley kPulleys[] = {{"crank pulley", 50, 230, 72},
                               {"alternator pulley", -150, 345, 27},
                               {"compressor pulley", -150, 185, 54},
                               {"water pump pulley", 40, 385, 46},
                               {"steering pump pulley", 178, 360, 50}};

// A frame whose z axis points towards -x.
Frame to_left(double x, double y, double z) { return facing({x, y, z}, {-1, 0, 0}, {0, 1, 0}); }

void add_pulley(Assembly& a, const Pulley& p) {
  // Six grooves, a dished web, a hub with a bolt.
  Profile profile = {{0, -12}, {14, -12}, {14, -4}, {p.radius * 0.72, -2}, {p.radius * 0.8, -13}};
  for (int i = 0; i < 6; ++i) {
    profile.push_back({p.radius, -12.5 + 4.0 * i});
    profile.push_back({p.radius, -11 + 4.0 * i});
    profile.push_back({p.radius - 2.4, -9.7 + 4.0 * i});
  }
  profile.insert(
      profile.end(),
      {{p.radius, 12}, {p.radius * 0.8, 13}, {p.radius * 0.72, 3}, {14, 2}, {14, 6}, {0, 6}});
  const Frame frame = to_left(kBeltX, p.y, p.z);
  a.add(p.name, revolve(profile, 72), frame);
  add_bolt(a, "pulley bolt", frame * at(0, 0, 6), p.radius > 60 ? 14 : 10, 30);
}

void add_belt_drive(Assembly& a) {
  std::vector<std::array<double, 3>> circles;
  for (const Pulley& p : kPulleys) {
    add_pulley(a, p);
    circles.push_back({p.y, p.z, p.radius + 2.4});
  }
  // The belt, seven ribs on its inside; the hull's long edges are cut to even steps.
  Line loop;
  const Polygon way = hull(circles, 96);
  for (std::size_t i = 0; i < way.size(); ++i) {
    const P2 p = way[i], q = way[(i + 1) % way.size()];
    const int steps = std::max(1, static_cast<int>(std::hypot(q.x - p.x, q.y - p.y) / 8));
    for (int k = 0; k < steps; ++k)
      loop.push_back({kBeltX, p.x + (q.x - p.x) * k / steps, p.y + (q.y - p.y) * k / steps});
  }
  Polygon section = {{2.2, -12.5}, {2.2, 12.5}};
  for (int i = 6; i >= 0; --i) {
    section.push_back({-0.2, -11 + 3.6 * i + 1.2});
    section.push_back({-2, -11 + 3.6 * i});
    section.push_back({-0.2, -11 + 3.6 * i - 1.2});
  }
  a.add("drive belt", sweep(loop, section, {1, 0, 0}, Ends::joined));

  const Outline cover{hull({{50, 230, 78}, {50, 420, 70}, {120, 420, 50}, {0, 200, 60}}, 64),
                      {circle(24, 40, kCrank)}};
  a.add("timing cover", extrude(cover, -246, -229), kAcross);
  for (int i = 0; i < 5; ++i)
    a.add("timing cover rib",
          extrude({hull({{50, 230, 3}, {-10.0 + 40 * i, 470, 3}}, 16), {}}, -250, -240), kAcross);
  add_bolt_row(a, "timing cover bolt", facing({-246, 0, 0}, {-1, 0, 0}, {0, 1, 0}),
               hull({{50, -230, 70}, {50, -420, 62}, {120, -420, 42}, {0, -200, 52}}, 48), 0, 58, 7,
               20);
}

void add_accessories(Assembly& a) {
  // Alternator: two half shells with cooling slits, fan, rear cover.
  const Frame alternator = to_left(-150, -150, 345);
  for (const double z : {12.0, 62.0})
    a.add("alternator housing",
          revolve({{0, z}, {60, z}, {64, z + 4}, {64, z + 30}, {58, z + 38}, {0, z + 38}}, 72),
          alternator);
  a.add("alternator stator", revolve({{0, 40}, {61, 40}, {61, 72}, {0, 72}}, 96), alternator);
  for (int i = 0; i < 24; ++i) {
    const Frame fin = rolled(alternator, 2 * std::numbers::pi * i / 24);
    a.add("alternator fin", box({34, -2.2, 0}, {57, 2.2, 13}), fin);
    a.add("alternator fin", box({34, -2.2, 98}, {57, 2.2, 104}), fin);
  }
  a.add("alternator cover", revolve({{0, -14}, {40, -14}, {48, -8}, {48, 6}, {0, 6}}, 60),
        alternator);
  a.add("alternator shaft", cylinder(10, 90, 114, 28), alternator);
  for (const double side : {-1.0, 1.0}) {
    const Outline ear{hull({{side * 74, 0, 11}, {side * 50, 14, 12}, {side * 50, -14, 12}}, 40),
                      {circle(5.2, 20, {side * 74, 0})}};
    for (const double z : {18.0, 78.0})
      a.add("alternator ear", extrude(ear, z, z + 14), alternator);
    add_bolt(a, "alternator bolt", alternator * at(side * 74, 0, 92), 9, 80);
  }
  add_bolt(a, "alternator terminal", alternator * facing({20, 26, -14}, {0, 0, -1}), 7, 16);

  // Air conditioning compressor with its clutch and two ports.
  const Frame compressor = to_left(-172, -150, 185);
  a.add("compressor body",
        revolve({{0, 0},
                 {40, 0},
                 {48, 6},
                 {48, 24},
                 {54, 26},
                 {54, 36},
                 {48, 38},
                 {48, 60},
                 {42, 66},
                 {0, 66}},
                72),
        compressor);
  a.add("compressor clutch", revolve({{0, 66}, {46, 66}, {46, 80}, {0, 80}}, 72), compressor);
  add_bolt_row(a, "compressor bolt", compressor * at(0, 0, 36), circle(50, 60), 0, 50, 7, 30);
  for (const double x : {14.0, 48.0})
    a.add("compressor port", block(24, 30, 22, 5, 3), facing({-172 - x, -158, 228}, {0, -0.4, 1}));
  for (const double z : {12.0, 50.0}) {
    Outline lug{hull({{52, 38, 10}, {52, -38, 10}, {20, 0, 30}}, 32),
                {circle(4.5, 18, {52, 38}), circle(4.5, 18, {52, -38})}};
    a.add("compressor bracket", extrude(lug, z - 5, z + 5), compressor);
  }
  a.add("water pump",
        revolve({{0, -16}, {52, -16}, {56, -8}, {40, 4}, {22, 8}, {22, 26}, {0, 26}}, 64),
        to_left(-230, 40, 385));
  a.add("steering pump",
        revolve({{0, -80}, {40, -80}, {46, -70}, {46, -12}, {22, 0}, {22, 14}, {0, 14}}, 64),
        to_left(-248, 178, 360));
}

void add_gearbox(Assembly& a) {
  const double sy = kStarterSeat.y, sz = kStarterSeat.z;
  // Plate between block and bell housing: a hole for the crankshaft, one for the starter's spigot.
  Outline plate{hull({{kCrank.x, kCrank.y, 186}, {sy, sz, 68}, {sy - 6, sz + 34, 44}}, 96), {}};
  plate.holes = {circle(62, 64, kCrank), circle(36.5, 56, {sy, sz})};
  const Frame seat = starter_seat();
  for (const double side : {-1.0, 1.0}) {
    const h6Vec3 p = seat.at({side * 49, side * 20, 0});
    plate.holes.push_back(circle(4.6, 24, {p.y, p.z}));
  }
  a.add("bell housing plate", extrude(plate, 100.5, 112), kAcross);
  Outline wall{plate.outer, {hull({{kCrank.x, kCrank.y, 172}, {sy, sz, 40}}, 96)}};
  a.add("bell housing", extrude(wall, 112, 186), kAcross);
  const Outline back{hull({{kCrank.x, kCrank.y, 172}, {sy, sz, 40}}, 96), {}};
  a.add("bell housing back", extrude(back, 184, 196), kAcross);
  for (int i = 0; i < 24; ++i) {  // bolts, where block and starter leave room for their heads
    const double angle = 2 * std::numbers::pi * i / 24;
    const double y = kCrank.x + 179 * std::cos(angle), z = kCrank.y + 179 * std::sin(angle);
    const bool at_block = std::abs(y - 50) < 124 && z > 138 && z < 484;
    if (at_block || std::hypot(y - sy, z - sz) < 125) continue;
    add_bolt(a, "bell housing bolt", facing({100.5, y, z}, {-1, 0, 0}), 9, 24);
  }
  a.add("flywheel", revolve({{0, 132}, {40, 132}, {44, 146}, {148, 146}, {148, 166}, {0, 166}}, 96),
        kAcross * at(kCrank.x, kCrank.y, 0));
  a.add("ring gear", extrude({gear(120, 147.5, 152), {circle(140, 96)}}, 150, 162),
        kAcross * at(kCrank.x, kCrank.y, 0));
  add_bolt_row(a, "flywheel bolt", facing({132, kCrank.x, kCrank.y}, {-1, 0, 0}), circle(30, 60), 0,
               31, 10, 20);

  // Case: a cone, a barrel with ribs, a cover with bolts; final drive behind it.
  const Frame axis = kAcross * at(kCrank.x, kCrank.y, 0);
  a.add("gearbox case",
        revolve({{0, 190}, {165, 190}, {150, 205}, {118, 240}, {112, 330}, {0, 330}}, 80), axis);
  for (int i = 0; i < 20; ++i)
    a.add("gearbox rib", box({0, -2.5, 195}, {128, 2.5, 322}),
          rolled(axis, 2 * std::numbers::pi * i / 20 + 0.1));
  a.add("gearbox flange", extrude({hull({{0, 0, 122}, {-30, -60, 80}}, 80), {}}, 322, 336), axis);
  a.add("gearbox cover", block(190, 180, 46, 40, 16, 8), axis * at(-8, -8, 334));
  add_bolt_row(a, "gearbox bolt", axis, hull({{0, 0, 116}, {-30, -60, 74}}, 64), 336, 45, 8, 28);
  a.add("final drive",
        revolve({{0, 196}, {70, 196}, {92, 210}, {92, 290}, {60, 312}, {0, 312}}, 72),
        kAcross * at(kShaft.x, kShaft.y, 0));
  a.add("gear lever",
        extrude({hull({{0, 0, 12}, {60, 20, 7}}, 32), {circle(3.2, 16, {60, 20})}}, 356, 362),
        at(260, 40, 0));
  a.add("gear lever shaft", cylinder(9, 320, 372, 28), at(260, 40, 0));
}

// A drive shaft to one side with two joints and their boots.
void add_shaft(Assembly& a, double from, double to) {
  const double way = to > from ? 1 : -1;
  const Frame axis = facing({from, kShaft.x, kShaft.y}, {way, 0, 0}, {0, 1, 0});
  const double length = std::abs(to - from);
  a.add("drive shaft", cylinder(13, 0, length, 36), axis);
  const auto boot = [&](double start) {
    Profile profile = {{0, start}, {40, start}, {40, start + 8}};
    for (int i = 0; i < 7; ++i) {
      const double r = 42 - 3.4 * i, z = start + 12 + 9.0 * i;
      for (const auto& [dr, dz] :
           {std::pair{0.0, 0.0}, {2.0, 1.5}, {2.0, 3.0}, {-3.5, 5.0}, {-5.0, 7.0}})
        profile.push_back({r + dr, z + dz});
    }
    profile.insert(profile.end(), {{16, start + 78}, {16, start + 86}, {0, start + 86}});
    a.add("drive shaft boot", revolve(profile, 56), axis);
    a.add("boot clamp",
          revolve({{40, start + 1}, {41.5, start + 1}, {41.5, start + 7}, {40, start + 7}}, 56,
                  Ends::joined),
          axis);
  };
  boot(14);
  a.add("drive shaft joint", revolve({{0, -6}, {30, -6}, {38, 0}, {38, 18}, {0, 18}}, 56), axis);
  if (length > 160)
    a.add("drive shaft damper",
          revolve({{12, 0}, {30, 0}, {32, 3}, {32, 35}, {30, 38}, {12, 38}}, 56, Ends::joined),
          axis * at(0, 0, length - 150));
}

}  // namespace

void add_drive(Assembly& a) {
  add_belt_drive(a);
  add_accessories(a);
  add_gearbox(a);
  add_shaft(a, 316, 448);
  add_shaft(a, 190, -448);
}

}  // namespace h6::io::industrial
