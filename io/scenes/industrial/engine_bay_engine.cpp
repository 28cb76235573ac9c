// SPDX-License-Identifier: Apache-2.0
// engine_bay_engine.cpp - a four-cylinder engine across the bay: block, pan, head, manifolds.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/engine_bay.h"

namespace h6::io::industrial {
namespace {

constexpr double kCylinders[] = {-190, -110, -30, 50};  // x of the cylinders' axes

void add_block(Assembly& a) {
  a.add("engine block", block(330, 214, 240, 14, 5), at(-65, 50, 150));
  // Cast ribs: on the front and rear faces, upright, lengthwise and crosswise.
  for (int i = 0; i <= 12; ++i) {
    const double x = -222 + 26.0 * i;
    a.add("engine block rib", box({x - 2.5, -62, 165}, {x + 2.5, 162, 372}));
  }
  for (const double z : {182.0, 226.0, 270.0, 314.0, 358.0})
    a.add("engine block rib", box({-225, -63, z - 2.5}, {95, 163, z + 2.5}));
  for (int i = 0; i < 4; ++i) {
    const double x = -205 + 78.0 * i;
    const h6Vec3 low = {x, 162, 170}, high = {x + 60, 162, 350};
    a.add("engine block rib", sweep({low, high}, rectangle(5, 8, 1, 2), {0, 1, 0}, Ends::capped));
  }
  for (const double x : {-175.0, -85.0, 5.0})  // core plugs
    a.add("core plug",
          revolve({{0, -1}, {13, -1}, {15, 2}, {17, 3}, {19, 3}, {19, -6}, {0, -6}}, 40),
          facing({x, -63, 292}, {0, -1, 0}));
  a.add("block flange", extrude({rectangle(336, 232, 16, 6), {}}, 372, 390), at(-65, 50, 0));
  add_bolt_row(a, "head bolt", at(-65, 50, 0), rectangle(318, 222, 10, 3), 390, 62, 9, 24);

  // Oil pan: a shallow and a deep part, flange, cooling fins, drain plug.
  a.add("oil pan flange", extrude({rectangle(336, 226, 16, 6), {}}, 142, 151), at(-65, 50, 0));
  a.add("oil pan", block(310, 196, 52, 26, 12), at(-65, 50, 94));
  a.add("oil pan sump", block(170, 180, 70, 30, 14), at(-130, 55, 48));
  for (int i = 0; i < 11; ++i)
    a.add("oil pan fin", box({-206 + 15.0 * i, -28, 42}, {-203 + 15.0 * i, 138, 60}));
  add_bolt(a, "drain plug", facing({-216, 60, 70}, {-1, 0, 0}), 14, 20);
  add_bolt_row(a, "oil pan bolt", facing({-65, 50, 142}, {0, 0, -1}), rectangle(324, 214, 10, 3), 0,
               60, 6, 18);
  // Oil filter on the rear face, with the flats for its wrench.
  std::vector<Line> rings;
  for (const P2& p : Profile{{20, 0},
                             {32, 2},
                             {38, 6},
                             {38.5, 10},
                             {38, 14},
                             {38, 70},
                             {37, 78},
                             {33, 84},
                             {26, 87}}) {
    Line ring;
    for (int i = 0; i < 60; ++i) {
      const double angle = 2 * std::numbers::pi * i / 60,
                   r = p.x - (p.y > 65 && i % 4 < 2 ? 1.2 : 0);
      ring.push_back({r * std::cos(angle), r * std::sin(angle), p.y});
    }
    rings.push_back(ring);
  }
  a.add("oil filter", loft(rings, Ends::capped), facing({-30, 160, 215}, {0, 1, 0}));
}

void add_head(Assembly& a) {
  a.add("cylinder head", block(334, 232, 82, 12, 4), at(-65, 50, 389));
  a.add("valve cover", block(318, 190, 66, 30, 16, 8), at(-65, 50, 468));
  a.add("valve cover flange", extrude({rectangle(330, 206, 22, 8), {}}, 469, 479), at(-65, 50, 0));
  add_bolt_row(a, "valve cover bolt", at(-65, 50, 0), rectangle(320, 196, 16, 3), 479, 60, 6, 26);
  for (int i = 0; i < 9; ++i)
    a.add("valve cover rib", block(4, 150, 6, 1.8, 1.5), at(-190 + 31.0 * i, 50, 531));
  a.add("oil filler cap", extrude({gear(14, 24, 27), {}}, 530, 552), at(-205, 20, 0));
  a.add("oil filler cap", block(44, 9, 10, 4, 3), at(-205, 20, 550));
  for (const double x : kCylinders) {  // coils over the plugs
    a.add("ignition coil", block(34, 56, 22, 6, 3), at(x + 12, 50, 531));
    a.add("ignition coil", block(22, 24, 16, 4, 2), at(x + 12, 88, 533));
    add_bolt(a, "coil bolt", at(x + 12, 28, 553), 6, 26);
  }
}

void add_intake(Assembly& a) {
  // Plenum along the engine, bulging over each runner.
  Line axis;
  for (int i = 0; i <= 110; ++i) axis.push_back({-232 + 3.0 * i, -205, 470});
  a.add("intake plenum",
        rod(
            axis,
            [](double s) {
              const double ends = std::min(1.0, std::sqrt(std::min(s, 330 - s) / 24 + 0.35));
              return ends * (35 + 2.5 * std::cos(2 * std::numbers::pi * (s - 42) / 80));
            },
            48));
  a.leave_hole("intake plenum", {-150, -228, 498}, 2);
  for (int i = 0; i < 9; ++i)
    a.add("intake plenum rib", box({-214 + 36.0 * i, -242, 462}, {-211 + 36.0 * i, -168, 480}));
  for (const double x : kCylinders) {
    const Line way = smooth({{x, -222, 488},
                             {x, -214, 522},
                             {x, -178, 545},
                             {x, -135, 530},
                             {x, -98, 480},
                             {x, -66, 432}},
                            5);
    const double length = line_length(way);
    a.add("intake runner", rod(
                               way, [length](double s) { return 21 - 3 * s / length; }, 32));
    if (x == kCylinders[1]) a.leave_hole("intake runner", {x, -178, 564}, 2);
    Outline flange{hull({{-27, 0, 9}, {27, 0, 9}, {0, 0, 27}}, 40), {}};
    flange.holes = {circle(4, 16, {-27, 0}), circle(4, 16, {27, 0})};
    const Frame port = facing({x, -66, 430}, {0, -1, 0.1});
    a.add("intake flange", extrude(flange, 0, 9), port);
    for (const double side : {-27.0, 27.0})
      add_bolt(a, "intake bolt", port * at(side, 0, 9), 7, 24);
    // Injector, from the rail down to the runner.
    const Frame injector = facing({x + 24, -98, 498}, {0, -0.35, 1});
    a.add("injector",
          revolve({{0, -52}, {4, -52}, {4, -36}, {8, -34}, {8, -14}, {6, -12}, {6, 4}, {0, 4}}, 28),
          injector);
    a.add("injector plug", block(12, 18, 14, 3, 1.5), injector * at(0, -12, -28));
  }
  Line rail;
  for (int i = 0; i <= 56; ++i) rail.push_back({-200 + 5.0 * i, -100, 504});
  a.add("fuel rail", rod(rail, 9.5, 24));
  // Throttle body and its motor.
  const Frame throttle = facing({-236, -205, 470}, {-1, 0, 0}, {0, 0, 1});
  a.add("throttle body",
        revolve({{28, -6}, {44, -6}, {44, 2}, {36, 4}, {36, 44}, {33, 46}, {33, 54}, {28, 54}}, 56,
                Ends::joined),
        throttle);
  a.add("throttle plate", revolve({{0, 24}, {28.5, 24}, {28.5, 26}, {0, 26}}, 48), throttle);
  a.add("throttle motor", block(34, 46, 62, 10, 4), throttle * facing({-30, 0, 22}, {-1, 0, 0}));
  for (int i = 0; i < 4; ++i) {
    const Frame ear =
        rolled(throttle, std::numbers::pi / 4 + std::numbers::pi / 2 * i) * at(40, 0, 0);
    add_bolt(a, "throttle bolt", ear * at(0, 0, 3), 6, 24);
  }
}

void add_exhaust(Assembly& a) {
  const h6Vec3 collector = {-70, 238, 340};
  for (const double x : kCylinders) {
    const double end = collector.x + (x - collector.x) * 0.2;
    a.add("exhaust pipe", rod(smooth({{x, 160, 430},
                                      {x, 196, 432},
                                      {x + (end - x) * 0.25, 228, 404},
                                      {x + (end - x) * 0.8, 240, 372},
                                      {end, 238, 338}},
                                     4),
                              17, 32));
    Outline flange{hull({{-26, 0, 10}, {26, 0, 10}, {0, 0, 26}}, 40), {}};
    flange.holes = {circle(5, 16, {-26, 0}), circle(5, 16, {26, 0})};
    const Frame port = facing({x, 164, 430}, {0, 1, 0});
    a.add("exhaust flange", extrude(flange, 0, 10), port);
    for (const double side : {-26.0, 26.0}) {
      a.add("exhaust stud", hex_bolt(7, 30), port * at(side, 0, 12));
      a.add("exhaust nut", nut(8), port * at(side, 0, 10));
    }
  }
  Profile can = {{0, 160}, {26, 160}, {26, 140}};
  for (int i = 0; i <= 8; ++i)
    can.push_back({26 + 29 * std::sin(std::numbers::pi / 2 * i / 8), 132 - 28 * i / 8.0});
  for (int i = 0; i < 26; ++i) can.push_back({55 + (i % 6 == 3 ? 1.5 : 0), 102 - 4.0 * i});
  for (int i = 0; i <= 8; ++i)
    can.push_back({55 - 30 * std::sin(std::numbers::pi / 2 * i / 8), -4 - 3.5 * i});
  can.push_back({25, -60});
  can.push_back({0, -60});
  a.add("catalytic converter", revolve(can, 72), at(collector.x, collector.y, 196));
  a.leave_hole("catalytic converter", {collector.x + 20, collector.y + 52, 246}, 2);
  a.add(
      "exhaust down pipe",
      rod(smooth({{-70, 238, 144}, {-70, 240, 100}, {-68, 250, 58}, {-64, 300, 34}, {-60, 372, 30}},
                 4),
          25, 36));
  // Heat shield: a dimpled sheet around half of the converter.
  a.add(
      "heat shield",
      sheet(
          60, 44,
          [&](double u, double v) {
            const double angle = std::numbers::pi * (-0.62 + 1.24 * u) + std::numbers::pi / 2,
                         z = 330 - 170 * v;
            const double r = 67 + 1.2 * std::cos(24 * std::numbers::pi * u) *
                                      std::cos(18 * std::numbers::pi * v);
            return h6Vec3{collector.x + r * std::cos(angle), collector.y + r * std::sin(angle), z};
          }),
      {}, Kind::sheet);
  a.add("oxygen sensor", hex_bolt(14, 30), facing({-20, 262, 318}, {1, 0.4, 0.4}));
}

}  // namespace

void add_engine(Assembly& a) {
  add_block(a);
  add_head(a);
  add_intake(a);
  add_exhaust(a);
}

}  // namespace h6::io::industrial
