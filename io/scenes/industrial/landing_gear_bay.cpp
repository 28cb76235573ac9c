// SPDX-License-Identifier: Apache-2.0
// landing_gear_bay.cpp - the bay the gear folds into: skins and ribs without thickness, rivets,
// brackets, doors.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/landing_gear.h"

namespace h6::io::industrial {
namespace {

constexpr double kRoof = 1992, kLeft = -320, kRight = 800, kHalfBay = 500;
constexpr Frame kBack = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {0, -1, 0}};  // 2-D (x, z), along -y

void add_rivets(Assembly& a, const std::string& name, const h6Vec3& from, const h6Vec3& to,
                const h6Vec3& out, double apart) {
  const double length_mm = norm(to - from);
  const int count = std::max(1, static_cast<int>(length_mm / apart));
  const Piece one = rivet(7, 24);
  for (int i = 0; i <= count; ++i)
    a.add(name, one, facing(from + (static_cast<double>(i) / count) * (to - from), out));
}

// A rib across the bay: a web with flanged lightening holes, and caps at its edges.
void add_rib(Assembly& a, double y, double low, bool trunnion) {
  Outline web{{{kLeft, low + 120},
               {kLeft + 150, low},
               {kRight - 150, low},
               {kRight, low + 120},
               {kRight, kRoof - 2},
               {kLeft, kRoof - 2}},
              {}};
  std::vector<std::array<double, 3>> holes;
  for (int i = 0; i < 7; ++i) {
    const double x = kLeft + 110 + 150.0 * i;
    if (!trunnion || std::abs(x) > 190) holes.push_back({x, low + 170, 48});
    holes.push_back({x, kRoof - 90, 36});
  }
  if (trunnion) holes.push_back({0, 1690, 92});
  for (const auto& [x, z, r] : holes) {
    web.holes.push_back(circle(r, 56, {x, z}));
    a.add("rib hole flange",
          revolve({{r, 0}, {r - 0.5, 4}, {r - 3, 9}, {r - 7, 12}}, 56, Ends::open),
          at(x, y, z) * facing({0, 0, 0}, {0, y > 0 ? -1.0 : 1.0, 0}), Kind::sheet);
  }
  a.add("bay rib", flat(web), kBack * at(0, 0, -y), Kind::sheet);
  const double way = y > 0 ? -1 : 1;
  for (const auto& [x0, x1, z] :
       {std::array{kLeft, kRight, kRoof - 2}, std::array{kLeft + 150, kRight - 150, low}}) {
    a.add("rib cap",
          sheet(40, 2,
                [&, &x0 = x0, &x1 = x1, &z = z](double u, double v) {
                  return h6Vec3{x0 + (x1 - x0) * u, y + way * 34 * v, z};
                }),
          {}, Kind::sheet);
    if (z < kRoof - 10)
      add_rivets(a, "rib rivet", {x0 + 15, y + way * 18, z}, {x1 - 15, y + way * 18, z}, {0, 0, -1},
                 15);
  }
  for (const double z : {low + 60, kRoof - 150.0})
    add_rivets(a, "rib rivet", {kLeft + 90, y, z}, {kRight - 90, y, z}, {0, -way, 0}, 15);
  for (int i = 0; i < 8; ++i) {  // upright stiffeners between the holes
    const double x = kLeft + 35 + 150.0 * i;
    if (std::abs(x) < 130 && trunnion) continue;
    const Polygon angle = {{0, 0}, {26, 0}, {26, 22}};
    a.add(
        "rib stiffener",
        sheet(10, 2,
              [&](double u, double v) {
                const P2 p = angle[static_cast<std::size_t>(std::lround(2 * v))];
                return h6Vec3{x + p.x, y + way * (1.5 + p.y), low + 130 + (kRoof - low - 140) * u};
              }),
        {}, Kind::sheet);
    add_rivets(a, "rib rivet", {x + 13, y, low + 140}, {x + 13, y, kRoof - 20}, {0, -way, 0}, 15);
  }
}

void add_roof(Assembly& a) {
  a.add("bay roof",
        sheet(60, 50,
              [](double u, double v) {
                return h6Vec3{kLeft + (kRight - kLeft) * u, -kHalfBay + 2 * kHalfBay * v,
                              kRoof + 6 * std::sin(std::numbers::pi * u)};
              }),
        {}, Kind::sheet);
  for (int i = 0; i < 12; ++i) {
    const double x = kLeft + 40 + 92.0 * i,
                 z = kRoof + 6 * std::sin(std::numbers::pi * (x - kLeft) / (kRight - kLeft));
    const Polygon zee = {{-34, 0}, {0, 0}, {0, -38}, {20, -38}};
    a.add("stringer",
          sheet(50, 3,
                [&](double u, double v) {
                  const P2 p = zee[static_cast<std::size_t>(std::lround(3 * v))];
                  return h6Vec3{x + p.x, -kHalfBay + 2 * kHalfBay * u, z - 2.5 + p.y};
                }),
          {}, Kind::sheet);
    for (const double dx : {-9.0, -25.0})
      add_rivets(a, "roof rivet", {x + dx, -kHalfBay + 12, z}, {x + dx, kHalfBay - 12, z},
                 {0, 0, 1}, 15);
  }
  for (const double x : {kLeft, kRight}) {
    a.add("bay side wall",
          sheet(40, 16,
                [&](double u, double v) {
                  return h6Vec3{x, -kHalfBay + 2 * kHalfBay * u, 1610 + (kRoof - 1610) * v};
                }),
          {}, Kind::sheet);
    for (const double z : {1640.0, 1760.0, 1880.0})
      add_rivets(a, "wall rivet", {x, -kHalfBay + 12, z}, {x, kHalfBay - 12, z},
                 {x < 0 ? -1.0 : 1.0, 0, 0}, 15);
  }
}

void add_brackets(Assembly& a) {
  // The posts of trunnion, stay and brace and the actuator's fork are bolted to beams.
  for (const double y : {-360.0, 360.0}) {
    Outline post{hull({{0, 1690, 92}, {-90, 1960, 30}, {90, 1960, 30}}, 80),
                 {circle(72, 72, {0, 1690})}};
    add_bolt_circle(post, 82, 12, 4, 0.2, {0, 1690});
    a.add("trunnion post", extrude(post, -y - 16, -y + 16), kBack);
    for (const double x : {-80.0, -40.0, 0.0, 40.0, 80.0})
      add_bolt(a, "post bolt", at(x, y, 1950) * facing({0, 17, 0}, {0, 1, 0}), 14, 40);
  }
  a.add("stay beam", block(70, 700, 80, 10, 4), at(640, 0, 1890));
  a.add("brace beam", block(600, 60, 80, 10, 4), at(0, -430, 1900));
  for (const double y : {-52.0, 24.0})
    a.add("stay fork",
          extrude({hull({{640, 1660, 46}, {590, 1930, 20}, {690, 1930, 20}}, 64),
                   {circle(17, 40, {640, 1660})}},
                  -y - 28, -y),
          kBack);
  for (const double y : {kBayPin.y - 44, kBayPin.y + 24})
    a.add("actuator fork",
          extrude({hull({{kBayPin.x, kBayPin.z, 34},
                         {kBayPin.x - 60, 1930, 20},
                         {kBayPin.x + 60, 1930, 20}},
                        64),
                   {circle(13.5, 40, {kBayPin.x, kBayPin.z}), circle(34, 48, {kBayPin.x, 1790})}},
                  -y - 20, -y),
          kBack);
  for (int i = 0; i < 14; ++i)
    for (const double x : {612.0, 668.0})
      add_bolt(a, "beam bolt", facing({x, -325 + 50.0 * i, 1890}, {0, 0, -1}), 10, 26);
  const Frame side = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  for (const double x : {-52.0, 24.0})
    a.add("brace fork",
          extrude({hull({{-430, 1650, 46}, {-470, 1940, 20}, {-390, 1940, 20}}, 64),
                   {circle(17, 40, {-430, 1650})}},
                  x, x + 28),
          side);
  for (int i = 0; i < 13; ++i)
    for (const double y : {-450.0, -410.0})
      add_bolt(a, "beam bolt", facing({-282 + 47.0 * i, y, 1900}, {0, 0, -1}), 10, 26);
}

// A door has a curved outer skin, an inner skin with lightening holes that follows it, stiffeners
// of hat section, and hinges. at_skin(s, t, d) gives a point of the door [mm]: s runs along y, t
// downwards, d into the bay.
void add_door(Assembly& a, const std::string& name,
              const std::function<h6Vec3(double, double, double)>& at_skin, double width,
              double height) {
  a.add(
      name + " outer skin",
      sheet(120, 90, [&](double u, double v) { return at_skin(width * (u - 0.5), height * v, 0); }),
      {}, Kind::sheet);
  // The inner skin is made of rows that are nearly flat, so that no triangle cuts through the
  // curve.
  const int across = static_cast<int>(width / 150), down = static_cast<int>(height / 160);
  const double row = (height - 40) / down;
  for (int j = 0; j < down; ++j) {
    const double middle = 20 + row * (j + 0.5);
    Outline inner{rectangle(width - 40, row, 0, 1, {0, middle}), {}};
    for (int i = 0; i < across; ++i)
      inner.holes.push_back(circle(34, 36, {width * ((i + 0.5) / across - 0.5) * 0.9, middle}));
    Piece pan = flat(inner);
    for (h6Vec3& p : pan.points) p = at_skin(p.x, p.y, 14);
    a.add(name + " inner skin", pan, {}, Kind::sheet);
  }
  const Polygon hat = {{-26, 2.5}, {-13, 2.5}, {-9, 22}, {9, 22}, {13, 2.5}, {26, 2.5}};
  for (int j = 0; j <= down; ++j) {
    const double t = height * (0.04 + 0.92 * j / down);
    a.add(name + " stiffener",
          sheet(48, 5,
                [&](double u, double v) {
                  const P2 p = hat[static_cast<std::size_t>(std::lround(5 * v))];
                  return at_skin((width - 30) * (u - 0.5), t + p.x, p.y);
                }),
          {}, Kind::sheet);
    const Piece one = rivet(7, 24);
    for (const double side : {-19.0, 19.0})
      for (int i = 0; i <= static_cast<int>(width / 15); ++i) {
        const double s = (width - 44) * (i / std::floor(width / 15) - 0.5);
        const h6Vec3 p = at_skin(s, t + side, 0);
        a.add(name + " rivet", one, facing(p, p - at_skin(s, t + side, 1)));
      }
  }
  for (const double s : {-0.36 * width, 0.36 * width}) {
    const h6Vec3 root = at_skin(s, 30, 16), high = at_skin(s, -70, 40);
    a.add(name + " hinge",
          rod(smooth({root, 0.5 * (root + high) + h6Vec3{0, 0, 8}, high}, 5), 13, 28));
    a.add(name + " hinge", revolve({{10, -30}, {24, -30}, {24, 30}, {10, 30}}, 48, Ends::joined),
          facing(high, {0, 1, 0}));
    a.add(name + " hinge pin", hex_bolt(18, 80), facing(high + h6Vec3{0, 40, 0}, {0, 1, 0}));
  }
}

void add_doors(Assembly& a) {
  const auto outboard = [](double s, double t, double d) {
    const double x = -392 - 40 * std::sin(std::numbers::pi * t / 760) + d;
    return h6Vec3{x, s, 1530 - t};
  };
  add_door(a, "strut door", outboard, 760, 720);
  for (const double y : {-90.0, 90.0}) {
    const h6Vec3 p = {-78, y * 0.6, 1240}, q = {-412, y, 1200};
    a.add("door link", rod(
                           Line{p, p + 0.3 * (q - p), p + 0.7 * (q - p), q},
                           [](double s) { return 9 + 3 * std::sin(s / 110); }, 28));
    for (const h6Vec3& e : {p, q}) {
      a.add("door link eye", revolve({{7, -9}, {18, -9}, {18, 9}, {7, 9}}, 48, Ends::joined),
            facing(e, {0, 1, 0}));
      add_bolt(a, "door link bolt", facing(e + h6Vec3{0, 10, 0}, {0, 1, 0}), 11, 34);
    }
  }
  const auto inboard = [](double s, double t, double d) {
    return h6Vec3{806 + 30 * std::sin(std::numbers::pi * t / 560) - d, s, 1590 - t};
  };
  add_door(a, "bay door", inboard, 900, 520);
}

}  // namespace

void add_bay(Assembly& a) {
  for (const double y : {-494.0, -310.0, 310.0, 494.0}) add_rib(a, y, 1560, std::abs(y) < 400);
  add_roof(a);
  add_brackets(a);
  add_doors(a);
}

}  // namespace h6::io::industrial
