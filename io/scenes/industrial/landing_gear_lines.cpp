// SPDX-License-Identifier: Apache-2.0
// landing_gear_lines.cpp - hydraulic lines, hoses, valves, and bundles of wires two voxels thick.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/landing_gear.h"

namespace h6::io::industrial {
namespace {

// A point beside the strut, r from its axis at an angle around it.
h6Vec3 beside(double angle, double r, double z) {
  return {r * std::cos(angle), r * std::sin(angle), z};
}

void add_fitting(Assembly& a, const h6Vec3& where, const h6Vec3& along, double d) {
  const Frame frame = facing(where, along);
  a.add("fitting nut", nut(d), frame);
  a.add("fitting", hex_bolt(0.8 * d, 1.2 * d), frame * at(0, 0, 0.8 * d));
}

// Six steel lines run down the strut in clamps; each ends in a hose that follows the piston.
void add_strut_lines(Assembly& a) {
  for (int i = 0; i < 6; ++i) {
    const double angle = std::numbers::pi * (1.02 + 0.075 * i), r = 106;
    const double side = i < 3 ? -1 : 1;
    const Line line = smooth({{-150 - 14.0 * i, -180, 1880},
                              {-140 - 14.0 * i, -150, 1800},
                              beside(angle, 150, 1700),
                              beside(angle, r, 1600),
                              beside(angle, r, 1400),
                              beside(angle, r, 1100),
                              beside(angle, r, 960)},
                             9);
    a.add("hydraulic line", rod(line, 5.5, 18));
    add_fitting(a, line.back(), {0, 0, -1}, 14);
    const Line hose = smooth({beside(angle, r, 958),
                              beside(angle, r + 8, 900),
                              beside(angle, r + 60 + 8 * i, 780),
                              beside(angle + 0.1 * side, r + 50 + 8 * i, 640),
                              {side * (70 + 12.0 * i), -120, 540},
                              {side * (100 + 6.0 * i), -128, 470},
                              {side * (118 + 5.0 * (i % 3)), -90 - 14.0 * (i % 3), 420}},
                             1.5);
    a.add(
        "brake hose",
        rod(
            hose, [](double s) { return 9.5 + 0.9 * std::cos(2 * std::numbers::pi * s / 9); }, 24));
    if (i == 2) a.leave_hole("brake hose", hose[hose.size() / 2] + h6Vec3{0, -10, 0}, 30);
    add_fitting(a, hose.back(), {side, 0, 0}, 14);
  }
  for (const double z : {1480.0, 1360.0, 1140.0, 1060.0}) {
    for (int i = 0; i < 6; ++i) {
      const double angle = std::numbers::pi * (1.02 + 0.075 * i);
      a.add("line clamp", revolve({{5, -7}, {9.5, -7}, {9.5, 7}, {5, 7}}, 28, Ends::joined),
            at(0, 0, z) * facing(beside(angle, 106, 0), {0, 0, 1}));
    }
    a.add("clamp bar",
          sweep({beside(std::numbers::pi * 1.0, 97, z), beside(std::numbers::pi * 1.21, 96, z),
                 beside(std::numbers::pi * 1.42, 97, z)},
                rectangle(14, 5, 1, 2), {0, 0, 1}, Ends::capped));
    for (const double f : {0.985, 1.42})
      add_bolt(a, "clamp bolt",
               facing(beside(std::numbers::pi * f, 99, z), beside(std::numbers::pi * f, 1, 0),
                      {0, 0, 1}),
               8, 20);
  }
}

// The manifold under the roof has ports, solenoid valves and an accumulator.
void add_manifold(Assembly& a) {
  const Frame manifold = at(-190, -200, 1880);
  a.add("manifold", block(150, 110, 62, 8, 3), manifold);
  for (int i = 0; i < 4; ++i) {
    const Frame valve = facing({-250 + 38.0 * i, -256, 1912}, {0, -1, 0});
    a.add("solenoid valve",
          revolve({{0, 0}, {15, 0}, {15, 10}, {12, 12}, {12, 56}, {9, 60}, {0, 60}}, 48), valve);
    a.add("solenoid valve", block(26, 32, 34, 4, 2), valve * at(0, 0, 16));
    a.add("valve plug", block(16, 16, 20, 3, 1.5), valve * at(0, 18, 26));
    add_fitting(a, {-250 + 38.0 * i, -145, 1900}, {0, 1, 0}, 13);
  }
  Profile ball;
  for (int i = 0; i <= 40; ++i) {
    const double t = -std::numbers::pi / 2 + std::numbers::pi * i / 40;
    ball.push_back({i == 0 || i == 40 ? 0 : 62 * std::cos(t), 62 * std::sin(t)});
  }
  const Profile inner = [&] {
    Profile out = ball;
    for (P2& p : out) p = {p.x * 54 / 62, p.y * 54 / 62};
    return out;
  }();
  a.add("accumulator inner wall", revolve(inner, 80), at(-190, 90, 1900));
  a.add("accumulator outer wall", revolve(ball, 80), at(-190, 90, 1900));
  a.leave_hole("accumulator outer wall", {-225, 50, 1868}, 2);
  a.add("accumulator seam", revolve({{61, -5}, {68, -5}, {68, 5}, {61, 5}}, 80, Ends::joined),
        at(-190, 90, 1900));
  add_fitting(a, {-190, 90, 1838}, {0, 0, -1}, 18);
}

// Lines along the bay's roof, with bends.
void add_roof_lines(Assembly& a) {
  for (int i = 0; i < 8; ++i) {
    const double x = 180 + 16.0 * i, z = 1935 - 5.0 * (i % 3);
    a.add("roof line", rod(smooth({{x, -480, z},
                                   {x, -440, z},
                                   {x, -200, z},
                                   {x + 24, -150, z},
                                   {x + 24, 60, z},
                                   {x, 110, z},
                                   {x, 440, z},
                                   {x, 480, z}},
                                  10),
                           i % 2 == 0 ? 6.0 : 4.5, 18));
  }
  for (const double y : {-380.0, -80.0, 300.0}) {
    a.add("roof clamp", block(170, 18, 16, 3, 1.5), at(248, y, 1946));
    for (const double x : {158.0, 338.0})
      add_bolt(a, "roof clamp bolt", facing({x - 2, y, 1946}, {0, 0, -1}), 8, 24);
  }
}

void add_line_plug(Assembly& a, const h6Vec3& where, const h6Vec3& along) {
  const Frame plug = facing(where, along);
  a.add(
      "connector",
      revolve({{0, -12}, {15, -12}, {17, -9}, {17, 10}, {14, 12}, {14, 22}, {11, 30}, {0, 30}}, 40),
      plug);
  a.add("connector ring", extrude({gear(24, 17, 18.5), {circle(15, 36)}}, -6, 8), plug);
}

h6Vec3 strut(double fraction, double z, double out = 108) {
  return beside(std::numbers::pi * fraction, out, z);
}

void add_harnesses(Assembly& a) {
  const double r = kGearWire;
  add_bundle(a, "strut harness",
             {{-60, -480, 1930},
              {-70, -380, 1920},
              {-100, -250, 1850},
              strut(1.66, 1700, 150),
              strut(1.62, 1600),
              strut(1.62, 1300),
              strut(1.62, 1050),
              strut(1.62, 940),
              strut(1.66, 860, 128),
              {60, -220, 740},
              {90, -190, 600},
              {104, -110, 500},
              {112, -84, 440}},
             19, r);
  add_bundle(a, "second harness",
             {{-30, -480, 1940},
              {-30, -380, 1930},
              {-40, -250, 1850},
              strut(1.76, 1690, 150),
              strut(1.74, 1600),
              strut(1.74, 1300),
              strut(1.74, 1050),
              strut(1.74, 950),
              {120, -190, 850},
              {160, -230, 740},
              {150, -170, 600},
              {126, -120, 500},
              {120, -84, 450}},
             19, r);
  add_bundle(a, "roof harness",
             {{420, -490, 1930},
              {420, -300, 1930},
              {440, -100, 1925},
              {430, 100, 1930},
              {440, 300, 1930},
              {440, 490, 1930}},
             19, r);
  add_bundle(a, "roof harness two",
             {{500, -490, 1930},
              {500, -300, 1930},
              {520, -100, 1925},
              {510, 100, 1930},
              {520, 300, 1930},
              {520, 490, 1930}},
             13, r);
  add_bundle(a, "wall harness",
             {{-300, -490, 1850},
              {-296, -300, 1840},
              {-296, -100, 1850},
              {-300, 100, 1840},
              {-296, 300, 1850},
              {-300, 490, 1850}},
             19, r);
  add_bundle(a, "door harness",
             {{-296, -320, 1850},
              {-290, -330, 1750},
              {-300, -340, 1600},
              {-350, -350, 1500},
              {-376, -350, 1350},
              {-390, -300, 1100},
              {-380, -100, 1000}},
             7, r);
  add_bundle(a, "lock harness",
             {{440, -60, 1925},
              {400, -70, 1850},
              {330, -62, 1700},
              {260, -60, 1560},
              {210, -66, 1440},
              {180, -70, 1300}},
             7, r);
}

void add_single_wires(Assembly& a) {
  const auto lone = [&](const std::string& name, const std::vector<h6Vec3>& through) {
    a.add_wire(name, smooth(through, 16), kGearWire);
    add_line_plug(a, through.back(), through.back() - through[through.size() - 2]);
  };
  for (int i = 0; i < 4; ++i)
    lone("valve wire", {{-296, -250, 1850},
                        {-286, -330 - 6.0 * i, 1830},
                        {-262 + 30.0 * i, -350, 1850},
                        {-250 + 38.0 * i, -345, 1900},
                        {-250 + 38.0 * i, -320, 1906}});
  for (int i = 0; i < 3; ++i)
    lone("sensor wire", {{180, -70, 1300},
                         {190 - 20.0 * i, -100, 1240},
                         {150, -120 + 6.0 * i, 1180 - 30.0 * i},
                         {112, -70, 1150 - 60.0 * i},
                         {104, -50, 1140 - 62.0 * i}});
  for (const double side : {-1.0, 1.0}) {
    lone("wheel speed wire", {{112, -84, 440},
                              {side * 130, -140, 430},
                              {side * 150, -150, 410},
                              {side * 128, -120, 400}});
    a.add("junction box", block(120, 70, 50, 6, 3), at(-120, side * 200 - 60, 1935));
  }
}

void add_harness_clamps(Assembly& a) {
  for (const double z : {1520.0, 1420.0, 1240.0, 1090.0, 1000.0})
    for (const double f : {1.62, 1.74}) {
      a.add("harness clamp", revolve({{11, -8}, {14, -8}, {14, 8}, {11, 8}}, 36, Ends::joined),
            facing(strut(f, z), {0, 0, 1}));
      add_bolt(a, "harness clamp bolt",
               facing(strut(f + 0.055, z, 98), strut(f + 0.055, 0, 1), {0, 0, 1}), 6, 18);
    }
}

}  // namespace

void add_gear_lines(Assembly& a) {
  add_strut_lines(a);
  add_manifold(a);
  add_roof_lines(a);
  add_harnesses(a);
  add_single_wires(a);
  add_harness_clamps(a);
}

}  // namespace h6::io::industrial
