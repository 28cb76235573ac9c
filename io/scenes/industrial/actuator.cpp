// SPDX-License-Identifier: Apache-2.0
// actuator.cpp - a landing gear's retraction actuator, 25,191 triangles.
//
// The pin of its fixed end is the x axis. The actuator pushes along +z; the rod end's pin is 580 mm
// away, parallel to the first. A closed surface has an even number of triangles, but the paper's
// part has an odd number. So one triangle is there twice, as in some CAD exports; the rest is
// closed.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/landing_gear.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kBarrel = 46;                                       // outer radius [mm]
const Frame kAlongX = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};  // 2-D (y, z), extruded along x

void add_ends(Assembly& a) {
  // Fixed end: a lug with a bush, a cap screwed into the barrel.
  Outline lug{hull({{0, 0, 32}, {-26, 52, 8}, {26, 52, 8}}, 64), {circle(17, 48)}};
  a.add("actuator lug", extrude(lug, -17, 17), kAlongX);
  a.add("actuator bush", revolve({{13, -19}, {17.2, -19}, {17.2, 19}, {13, 19}}, 56, Ends::joined),
        kAlongX);
  a.add("actuator end cap",
        revolve({{0, 44}, {40, 44}, {52, 50}, {54, 54}, {54, 80}, {50, 84}, {0, 84}}, 64));
  for (int i = 0; i < 8; ++i) {
    const double angle = std::numbers::pi / 8 + std::numbers::pi / 4 * i;
    a.add("actuator cap bolt", socket_bolt(7, 8),
          facing({45 * std::cos(angle), 45 * std::sin(angle), 47}, {0, 0, -1}));
  }
  a.add("grease fitting",
        revolve({{0, 28}, {5, 28}, {5, 34}, {3, 36}, {3, 38}, {4, 40}, {3, 43}, {0, 44}}, 28),
        facing({0, 0, 0}, {0, -1, 0}));

  // Rod end: a fork's eye with a spherical bearing, lock nut, wiper.
  const Frame eye = at(0, 0, kActuatorLength) * kAlongX;
  Outline end{hull({{0, 0, 30}, {0, -46, 17}}, 64), {circle(19, 56)}};
  a.add("rod end", extrude(end, -13, 13), eye);
  Profile ball;
  for (int i = 0; i <= 16; ++i) {
    const double t = -0.9 + 1.8 * i / 16;
    ball.push_back({20 * std::cos(t), 20 * std::sin(t)});
  }
  ball.push_back({13, ball.back().y});
  ball.push_back({13, ball.front().y});
  a.add("rod end ball", revolve(ball, 40, Ends::joined), eye);
  a.add("rod end lock nut", placed(nut(34), at(0, 0, 484)));
  a.add("rod end lock washer", extrude({gear(8, 28, 33), {circle(20, 40)}}, 480, 484));
}

void add_barrel(Assembly& a) {
  Profile profile = {{0, 70}, {kBarrel, 70}};
  for (int i = 0; i < 8; ++i) {  // turned, with lands
    const double z = 100 + 28.0 * i;
    profile.insert(
        profile.end(),
        {{kBarrel, z}, {kBarrel - 1.5, z + 2}, {kBarrel - 1.5, z + 20}, {kBarrel, z + 22}});
  }
  profile.insert(profile.end(), {{kBarrel, 372}, {0, 372}});
  a.add("actuator barrel", revolve(profile, 64));
  a.add("gland",
        revolve(
            {{0, 350}, {53, 350}, {55, 353}, {55, 386}, {51, 391}, {38, 393}, {34, 402}, {0, 402}},
            64));
  a.add("gland nut", extrude({gear(12, 50, 56), {circle(44, 56)}}, 372, 384));
  for (int i = 0; i < 10; ++i) {
    const double angle = 2 * std::numbers::pi * i / 10;
    a.add("gland bolt", hex_bolt(6, 8), at(44.5 * std::cos(angle), 44.5 * std::sin(angle), 391));
  }
  a.add("gland wiper",
        revolve({{24, 400}, {32, 400}, {30, 408}, {26, 410}, {24, 410}}, 56, Ends::joined));
  a.add("actuator piston rod", cylinder(24, 300, 560 - 20, 72));
  // Two bands carry the line; a position sensor with its plug is on the other side.
  for (const double z : {150.0, 290.0}) {
    a.add("line band", revolve({{kBarrel - 1, z - 9},
                                {kBarrel + 2, z - 9},
                                {kBarrel + 2, z + 9},
                                {kBarrel - 1, z + 9}},
                               72, Ends::joined));
    a.add("line band lug", block(22, 16, 18, 3, 1.5), at(0, -kBarrel - 8, z - 9));
    a.add("line band bolt", hex_bolt(6, 8), facing({0, -kBarrel - 16, z}, {0, -1, 0}));
  }
}

void add_hydraulics(Assembly& a) {
  // A port has a boss, a fitting with its nut, and an elbow. The far port's line runs back beside
  // the barrel.
  const auto port = [&](double z, double side) {
    const Frame boss = facing({side * (kBarrel - 6), 0, z}, {side, 0, 0}, {0, 0, 1});
    a.add("port boss", block(34, 34, 16, 9, 2.5), boss);
    a.add("port fitting", hex_bolt(13, 14), boss * at(0, 0, 16));
    a.add("port fitting", revolve({{0, 14}, {9, 14}, {9, 34}, {7, 36}, {0, 36}}, 32), boss);
    a.add("port nut", nut(14), boss * at(0, 0, 26));
  };
  port(104, 1);
  port(338, 1);
  const double x = kBarrel + 34;
  a.add("actuator line", rod(smooth({{x - 10, 0, 338},
                                     {x + 6, -2, 338},
                                     {x + 10, -14, 326},
                                     {52, -44, 300},
                                     {30, -66, 270},
                                     {18, -67, 230},
                                     {18, -67, 150},
                                     {20, -66, 100},
                                     {30, -60, 66},
                                     {44, -44, 40}},
                                    6),
                             5.5, 16));
  a.add("actuator line nut", nut(9), facing({44, -44, 40}, {0.5, 0.5, -0.8}));
  a.add("restrictor", block(26, 24, 40, 5, 2), at(18, -67, 186));
  a.add("bleed screw", hex_bolt(8, 14), facing({0, kBarrel + 6, 350}, {0, 1, 0}));
}

void add_sensor(Assembly& a) {
  a.add("position sensor", block(30, 26, 170, 5, 2.5), at(0, kBarrel + 11, 130));
  for (const double z : {140.0, 290.0})
    for (const double sx : {-10.0, 10.0})
      a.add("sensor screw", socket_bolt(4, 5), facing({sx, kBarrel + 24, z}, {0, 1, 0}));
  const Frame plug = facing({0, kBarrel + 12, 300}, {0, 0.35, 1});
  a.add("sensor plug",
        revolve({{0, -6},
                 {11, -6},
                 {11, 6},
                 {13, 7},
                 {13, 22},
                 {11, 24},
                 {9, 34},
                 {5, 36},
                 {5, 48},
                 {0, 48}},
                48),
        plug);
  a.add("sensor plug ring", extrude({gear(18, 13, 14.2), {}}, 8, 20), plug);
  Outline plate{{{-11, 0}, {11, 0}, {11, 54}, {5, 60}, {-11, 60}}, {}};
  a.add("name plate", extrude(plate, -1, 0.8),
        Frame{{0, kBarrel + 24, 180}, {-1, 0, 0}, {0, 0, 1}, {0, 1, 0}});
}

}  // namespace

namespace industrial {
Frame actuator_seat() {
  const h6Vec3 along = unit(kStrutPin - kBayPin), across = {0, -1, 0};
  return {kBayPin, across, cross(along, across), along};
}
}  // namespace industrial

Mesh make_actuator() {
  Assembly a(kMm * kGearVoxel, 25191);
  add_ends(a);
  add_barrel(a);
  add_hydraulics(a);
  add_sensor(a);
  Mesh mesh = a.sound(25190);
  mesh.triangles.push_back(mesh.triangles.front());
  mesh.part.push_back(mesh.part.front());
  return mesh;
}

}  // namespace h6::io
