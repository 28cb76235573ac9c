// SPDX-License-Identifier: Apache-2.0
// starter_motor.cpp - a car's starter motor with its solenoid, 18,580 triangles.
//
// The shaft is the z axis. The flange's face, which meets the bell housing, is z = 0. Spigot and
// pinion point towards +z, the motor lies behind the flange. The solenoid is on the +y side.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/assembly.h"

namespace h6::io {
namespace {

using namespace industrial;

constexpr double kBody = 37;              // radius of the yoke [mm]
constexpr double kSolenoidY = 63;         // y of the solenoid's axis
constexpr double kEarY = 20, kEarX = 49;  // of the flange bolts' holes

void add_nose(Assembly& a) {
  a.add("starter spigot",
        revolve({{33, -4}, {33, 5}, {31, 7}, {24, 9}, {24, 13}, {17, 14}, {17, -4}}, 64,
                Ends::joined));
  a.add("starter clutch",
        revolve({{0, 8}, {16, 8}, {16, 17}, {14.5, 18.5}, {14.5, 21}, {0, 21}}, 48));
  Outline pinion{gear(11, 10.2, 15), {circle(6.2, 24)}};
  a.add("starter pinion", extrude(pinion, 21, 38));
  a.add("starter shaft", revolve({{0, -2}, {6, -2}, {6, 44}, {5, 46}, {0, 46}}, 32));
  a.add("starter stop ring",
        revolve({{6, 39}, {8.5, 39}, {9, 40}, {8.5, 41}, {6, 41}}, 40, Ends::joined));
}

void add_drive_housing(Assembly& a) {
  Outline flange{
      hull({{0, 0, 40}, {kEarX, kEarY, 13}, {-kEarX, -kEarY, 13}, {0, kSolenoidY, 22}}, 72), {}};
  flange.holes = {circle(28, 48), circle(5.4, 28, {kEarX, kEarY}),
                  circle(5.4, 28, {-kEarX, -kEarY})};
  a.add("starter flange", extrude(flange, -12, 0));
  a.add("starter drive housing", revolve({{0, -62},
                                          {38, -62},
                                          {39.5, -58},
                                          {39.5, -50},
                                          {36, -46},
                                          {35, -28},
                                          {38, -10},
                                          {0, -10}},
                                         64));
  Outline neck{hull({{0, 0, 34}, {0, kSolenoidY, 25}}, 64), {}};
  a.add("starter drive housing", extrude(neck, -42, -11));
  for (const double x : {-30.0, -10.0, 10.0, 30.0})  // cast ribs between flange and housing
    a.add("starter rib", box({x - 2, -41 + std::abs(x) * 0.35, -50}, {x + 2, 0, -10}));
  for (const double side : {-1.0, 1.0}) {
    const Frame ear = at(side * kEarX, side * kEarY, 0);
    a.add("starter ear boss",
          revolve({{5.4, -18}, {11, -18}, {12, -17}, {12, -11}, {5.4, -11}}, 40, Ends::joined),
          ear);
  }
}

void add_motor(Assembly& a) {
  a.add("starter yoke", revolve({{0, -176},
                                 {kBody - 1, -176},
                                 {kBody, -175},
                                 {kBody, -120},
                                 {kBody + 0.6, -119},
                                 {kBody + 0.6, -113},
                                 {kBody, -112},
                                 {kBody, -61},
                                 {kBody - 1, -60},
                                 {0, -60}},
                                72));
  a.add("starter brush cover",
        revolve({{kBody - 1, -172}, {kBody + 0.9, -172}, {kBody + 0.9, -154}, {kBody - 1, -154}},
                72, Ends::joined));
  a.add("starter end cap", revolve({{0, -198},
                                    {9, -198},
                                    {11, -196},
                                    {11, -190},
                                    {26, -188},
                                    {34, -185},
                                    {37.5, -181},
                                    {38.5, -176},
                                    {38.5, -173},
                                    {0, -173}},
                                   72));
  // Field coil screws, countersunk pads.
  for (int i = 0; i < 4; ++i) {
    const double angle = std::numbers::pi / 4 + std::numbers::pi / 2 * i;
    const h6Vec3 out = {std::cos(angle), std::sin(angle), 0};
    const Frame on = facing(kBody * out + h6Vec3{0, 0, -90}, out, {0, 0, 1});
    a.add("starter pole screw",
          revolve({{0, 0.6}, {3, 0.6}, {3, 1.6}, {6.5, 2}, {7, -2}, {0, -2}}, 28), on);
  }
  // Two through bolts hold end cap, yoke and drive housing together.
  for (const double side : {-1.0, 1.0}) {
    const double angle = 0.15 + (side > 0 ? 0 : std::numbers::pi);
    const h6Vec3 p = {41 * std::cos(angle), 41 * std::sin(angle), 0};
    a.add("starter through bolt", cylinder(2.7, -186, -46, 20), at(p.x, p.y, 0));
    a.add("starter through bolt", hex_bolt(5, 12), facing(p + h6Vec3{0, 0, -185}, {0, 0, -1}));
    Outline lug{hull({{p.x, p.y, 5.5}, {0.7 * p.x, 0.7 * p.y, 8}}, 36), {}};
    a.add("starter through bolt lug", extrude(lug, -185, -177));
    a.add("starter through bolt lug", extrude(lug, -60, -48));
  }
  for (int i = 0; i < 2; ++i)
    a.add("starter end screw", socket_bolt(4, 10),
          facing({i == 0 ? 17.0 : -17.0, 0, -188.5}, {0, 0, -1}));
}

void add_solenoid(Assembly& a) {
  const Frame axis = at(0, kSolenoidY, 0);
  a.add("solenoid can",
        revolve({{0, -128},
                 {26.5, -128},
                 {27.5, -127},
                 {27.5, -122},
                 {26, -121},
                 {25, -119},
                 {25, -52},
                 {26.5, -50},
                 {26.5, -40},
                 {0, -40}},
                72),
        axis);
  a.add("solenoid cap",
        revolve(
            {{0, -150}, {18, -150}, {21, -148}, {22, -140}, {24.5, -138}, {24.5, -126}, {0, -126}},
            64),
        axis);
  // Two studs, for battery and motor, each with a washer and two nuts.
  for (const double x : {-10.0, 10.0}) {
    const Frame stud = axis * facing({x, -2, -150}, {0, 0, -1});
    a.add("solenoid stud", hex_bolt(7, 22), stud * facing({0, 0, -2}, {0, 0, -1}));
    a.add("solenoid stud", washer(8), stud * at(0, 0, 0.2));
    a.add("solenoid stud", nut(8), stud * at(0, 0, 1.7));
    a.add("solenoid stud", nut(8), stud * at(0, 0, 10));
  }
  const Frame spade = axis * at(0, 12, -150);
  a.add("solenoid spade", box({-3.2, -0.5, -12}, {3.2, 0.5, 1}), spade);
  a.add("solenoid spade", block(14, 7, 9, 1.5, 1), spade * at(0, 0, -8));
  // The strap from the motor's stud into the yoke, copper.
  a.add("starter strap", rod(smooth({{10, kSolenoidY - 2, -159},
                                     {13, kSolenoidY - 12, -163},
                                     {14, 46, -158},
                                     {12, 38, -148},
                                     {11, 33, -146}},
                                    1.6),
                             3.4, 18));
  a.add("starter grommet", revolve({{0, -3}, {8, -3}, {8, 3}, {5, 7}, {0, 7}}, 32),
        facing({11, 34, -147}, {0.3, 1, -0.1}));
}

}  // namespace

Mesh make_starter_motor() {
  Assembly a(0.9 * kMm, 18580);
  add_nose(a);
  add_drive_housing(a);
  add_motor(a);
  add_solenoid(a);
  return a.sound(18580);
}

}  // namespace h6::io
