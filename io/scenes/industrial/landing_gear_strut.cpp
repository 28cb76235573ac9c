// SPDX-License-Identifier: Apache-2.0
// landing_gear_strut.cpp - the shock strut, its torque links, braces and brackets.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/landing_gear.h"

namespace h6::io::industrial {
namespace {

// Frames of extruded outlines: kSideFrame takes 2-D (y, z), along x; kBackFrame takes 2-D (x, z),
// along -y.
constexpr Frame kSideFrame = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
constexpr Frame kBackFrame = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, -1, 0}};

void add_cylinder(Assembly& a) {
  Profile body = {{0, 1770}, {64, 1770}, {78, 1756}, {84, 1730}, {84, 1640}};
  for (int i = 0; i <= 60; ++i) body.push_back({i % 15 == 7 ? 89.0 : 84.0, 1620 - 11.0 * i});
  body.insert(body.end(), {{90, 940}, {98, 925}, {98, 870}, {92, 860}, {0, 860}});
  a.add("main fitting", revolve(body, 120));
  a.leave_hole("main fitting", {60, -60, 1300}, 2);
  a.add("gland nut", extrude({gear(24, 88, 97), {circle(64, 72)}}, 832, 862));
  for (int i = 0; i < 5; ++i)
    a.add("gland ring", revolve({{63, 820 + 2.6 * i},
                                 {84 - 3.0 * i, 820 + 2.6 * i},
                                 {84 - 3.0 * i, 822 + 2.6 * i},
                                 {63, 822 + 2.6 * i}},
                                96, Ends::joined));
  a.add("chrome piston", revolve({{0, 440}, {62, 440}, {62, 900}, {0, 900}}, 120));
  a.add("axle fitting", block(190, 150, 130, 44, 14, 8), at(0, 0, 336));
  a.add("axle fitting",
        revolve({{0, 440}, {88, 440}, {84, 470}, {68, 500}, {66, 520}, {0, 520}}, 96));
  a.add("charging valve", hex_bolt(22, 30), at(0, 0, 1790));
  a.add("charging valve", revolve({{0, 1760}, {20, 1760}, {20, 1795}, {0, 1795}}, 48));
  a.add("jacking dome", revolve({{0, 318}, {18, 320}, {30, 328}, {34, 340}, {0, 340}}, 60));
  a.add("jacking point", revolve({{0, 300}, {12, 304}, {16, 320}, {0, 320}}, 40));
  // Trunnion: a cross tube on two pins, ribs that carry it.
  const Frame tube = facing({0, -380, 1690}, {0, 1, 0});
  a.add(
      "trunnion",
      revolve({{0, 0}, {40, 0}, {40, 60}, {62, 76}, {62, 684}, {40, 700}, {40, 760}, {0, 760}}, 96),
      tube);
  for (const double side : {-1.0, 1.0}) {
    const Outline web{
        counter_clockwise(
            {{side * 60, 1700}, {side * 60, 1420}, {side * 320, 1660}, {side * 320, 1700}}),
        {circle(26, 48, {side * 130, 1620})}};
    a.add("trunnion web", extrude(web, -9, 9), kSideFrame);
    a.add("trunnion bearing",
          revolve({{41, 0}, {70, 0}, {74, 6}, {74, 40}, {70, 46}, {41, 46}}, 80, Ends::joined),
          facing({0, side * 380, 1690}, {0, -side, 0}));
    a.add("trunnion nut", nut(70), facing({0, side * 382, 1690}, {0, side, 0}));
  }
  for (const double z : {1560.0, 1240.0, 980.0}) {
    a.add("strut band",
          revolve({{83, z - 16}, {93, z - 16}, {93, z + 16}, {83, z + 16}}, 120, Ends::joined));
    for (int i = 0; i < 12; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.5) / 12;
      add_bolt(a, "band bolt",
               facing({93 * std::cos(angle), 93 * std::sin(angle), z},
                      {std::cos(angle), std::sin(angle), 0}, {0, 0, 1}),
               9, 18);
    }
  }
}

// Two A-shaped links keep the piston from turning. They are hinged to each other, to the cylinder
// and to the axle.
void add_torque_links(Assembly& a) {
  const h6Vec3 top = {0, 112, 905}, apex = {0, 330, 690}, low = {0, 104, 480};
  for (const bool upper : {true, false}) {
    const h6Vec3 from = upper ? top : low;
    const h6Vec3 along = unit(apex - from);
    const double length_mm = norm(apex - from);
    const Frame frame = {from, along, {1, 0, 0}, cross(along, {1, 0, 0})};
    Outline link{hull({{0, 62, 30}, {0, -62, 30}, {length_mm, 0, 34}}, 64), {}};
    link.holes = {circle(34, 48, {62, 0}), circle(24, 40, {132, 0}), circle(15, 32, {188, 0}),
                  circle(12, 28, {20, 62}), circle(12, 28, {20, -62})};
    a.add("torque link", extrude(link, -12, 12), frame);
    for (const double side : {-1.0, 1.0}) {
      a.add("torque link rib",
            sweep({frame.at({0, side * 84, 0}), frame.at({length_mm - 8, side * 30, 0})},
                  rectangle(12, 44, 4, 3), frame.z, Ends::capped));
      a.add("torque link boss",
            revolve({{14, -26}, {34, -26}, {34, 26}, {14, 26}}, 64, Ends::joined),
            facing(frame.at({0, side * 66, 0}), {1, 0, 0}));
      Outline lug{hull({{from.y, from.z, 32}, {60, from.z + (upper ? 10 : -10), 46}}, 56),
                  {circle(14, 40, {from.y, from.z})}};
      a.add("torque link lug", extrude(lug, side * 30 - 14, side * 30 + 14), kSideFrame);
    }
    const Frame pin = facing(from + h6Vec3{-100, 0, 0}, {-1, 0, 0});
    a.add("torque link pin", cylinder(14, -206, 4, 48), pin);
    a.add("torque link pin", hex_bolt(20, 20), pin * at(0, 0, 4));
    a.add("torque link nut", nut(22), facing(from + h6Vec3{104, 0, 0}, {1, 0, 0}));
  }
  a.add("apex pin", cylinder(16, -70, 70, 48), facing(apex, {0, 0.7, 0.7}));
  a.add("shimmy damper", revolve({{0, -90}, {26, -90}, {30, -84}, {30, 84}, {26, 90}, {0, 90}}, 64),
        facing(apex + h6Vec3{0, 42, 0}, {1, 0, 0}));
  for (const double side : {-1.0, 1.0})
    add_bolt(a, "shimmy damper bolt", facing(apex + h6Vec3{side * 90, 42, 0}, {side, 0, 0}), 16,
             30);
}

// A strut of I section between two pins, with forks, lightening pockets and bolts.
void add_brace(Assembly& a, const std::string& name, const h6Vec3& from, const h6Vec3& to,
               const h6Vec3& pin, double depth) {
  const h6Vec3 along = unit(to - from), across = unit(cross(pin, along));
  const double length_mm = norm(to - from);
  const Frame web = {from, along, across, cross(along, across)};
  Outline plate{hull({{0, 0, 0.62 * depth}, {length_mm, 0, 0.62 * depth}}, 56),
                {circle(17, 40), circle(17, 40, {length_mm, 0})}};
  const int pockets = static_cast<int>(length_mm / 110);
  for (int i = 0; i < pockets; ++i)
    plate.holes.push_back(slot(36, 0.26 * depth, {length_mm * (i + 1) / (pockets + 1), 0}, 0, 10));
  a.add(name, extrude(plate, -7, 7), web);
  for (const double side : {-1.0, 1.0}) {
    a.add(
        name + " flange", block(length_mm - 60, 46, 12, 8, 3),
        web * Frame{{length_mm / 2, side * 0.55 * depth - 6, 0}, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}});
    const Frame end = facing(side < 0 ? from : to, pin);
    a.add(name + " bush", revolve({{16, -30}, {28, -30}, {28, 30}, {16, 30}}, 64, Ends::joined),
          end);
    a.add(name + " pin", cylinder(16, -52, 52, 48), end);
    a.add(name + " pin nut", nut(24), end * at(0, 0, 42));
    a.add(name + " pin head", hex_bolt(24, 8), end * facing({0, 0, -44}, {0, 0, -1}));
  }
}

void add_braces(Assembly& a) {
  // Side stay of two parts with its lock links and springs; drag brace ahead.
  const h6Vec3 low = {128, 0, 1010}, knee = {380, 0, 1330}, high = {640, 0, 1660};
  add_brace(a, "lower side stay", low, knee, {0, 1, 0}, 76);
  add_brace(a, "upper side stay", knee, high, {0, 1, 0}, 76);
  add_brace(a, "lock link", knee + h6Vec3{10, 0, 40}, {250, 0, 1500}, {0, 1, 0}, 44);
  add_brace(a, "lock link", {250, 0, 1500}, {110, 0, 1580}, {0, 1, 0}, 44);
  for (const double y : {-40.0, 40.0}) {
    const h6Vec3 p = {250, y, 1500}, q = {420, y, 1380};
    const double span = norm(q - p);
    a.add("down lock spring", rod(helix(15, (span - 50) / 26, 26, 28), 3.2, 10),
          facing(p + 25 / span * (q - p), q - p));
    for (const auto& [e, d] : {std::pair{p, q - p}, {q, p - q}})
      a.add("spring eye", rod(smooth({e, e + (14 / span) * d, e + (30 / span) * d}, 3), 5, 20));
  }
  add_brace(a, "drag brace", {0, -128, 1060}, {0, -430, 1650}, {1, 0, 0}, 80);
  for (const double y : {-34.0, 12.0})
    a.add("stay lug",
          extrude({hull({{low.x, low.z, 42}, {50, low.z + 20, 60}}, 56),
                   {circle(17, 40, {low.x, low.z})}},
                  -y - 22, -y),
          kBackFrame);
  for (const double x : {-34.0, 12.0})
    a.add("brace lug",
          extrude({hull({{-128, 1060, 42}, {-50, 1075, 60}}, 56), {circle(17, 40, {-128, 1060})}},
                  x, x + 22),
          kSideFrame);
  // An arm with a fork for the actuator.
  for (const double y : {kStrutPin.y - 42, kStrutPin.y + 22})
    a.add("actuator lug",
          extrude({hull({{kStrutPin.x, kStrutPin.z, 34}, {30, kStrutPin.z - 10, 52}}, 56),
                   {circle(13.5, 40, {kStrutPin.x, kStrutPin.z})}},
                  -y - 20, -y),
          kBackFrame);
  a.add("actuator lug arm", block(96, 190, 84, 20, 8), at(24, 150, kStrutPin.z - 60));
}

}  // namespace

void add_strut(Assembly& a) {
  add_cylinder(a);
  add_torque_links(a);
  add_braces(a);
}

}  // namespace h6::io::industrial
