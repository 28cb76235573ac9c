// SPDX-License-Identifier: Apache-2.0
// engine_bay_cooling.cpp - radiator with its fins, fans, and the hoses.
#include <cmath>
#include <numbers>

#include "io/scenes/industrial/engine_bay.h"

namespace h6::io::industrial {
namespace {

constexpr double kY = -357;  // y of the core's middle

void add_core(Assembly& a) {
  constexpr int kTubes = 30;
  constexpr double kPitch = 12, kLow = 100, kHalf = 270;
  for (int i = 0; i < kTubes; ++i) {
    const double z = kLow + kPitch * i;
    std::vector<Line> rings;
    for (const double x : {-kHalf - 6, kHalf + 6}) {
      Line ring;
      for (const P2& p : slot(22, 1.6, {kY, z}, 0, 4)) ring.push_back({x, p.x, p.y});
      rings.push_back(ring);
    }
    a.add("radiator tube", loft(rings, Ends::capped));
    if (i + 1 == kTubes) break;
    // A folded strip without thickness between this tube and the next; its flanks bulge.
    constexpr int kFolds = 90;
    const double low = z + 1.6, high = z + kPitch - 1.6;
    a.add("radiator fin",
          sheet(4 * kFolds, 1,
                [&](double u, double v) {
                  const double phase = u * kFolds - std::floor(u * kFolds + 1e-9);
                  const double up = std::abs(2 * phase - 1);
                  return h6Vec3{kHalf * (2 * u - 1), kY + 22 * (v - 0.5), low + (high - low) * up};
                }),
          {}, Kind::sheet);
  }
  for (const double side : {-1.0, 1.0}) {
    a.add("radiator tank", block(44, 50, 400, 12, 6), at(side * 296, kY, 80));
    a.add("radiator header", block(8, 40, 384, 2, 1), at(side * 273, kY, 86));
    for (int i = 0; i < 9; ++i)
      a.add("radiator tank rib", box({side * 296 - 23, kY - 26, 104 + 43.0 * i},
                                     {side * 296 + 23, kY + 26, 107 + 43.0 * i}));
  }
  for (const double z : {88.0, 466.0})
    a.add("radiator side plate", block(560, 30, 6, 3, 1), at(0, kY, z));
  a.add("radiator cap", extrude({gear(12, 20, 22), {}}, 478, 494), at(-296, kY, 0));
}

void add_fans(Assembly& a) {
  Outline shroud{rectangle(540, 372, 20, 5, {0, 278}), {}};
  for (const double x : {-132.0, 132.0}) shroud.holes.push_back(circle(118, 72, {x, 278}));
  a.add("fan shroud", flat(shroud), kFront * at(0, 0, 330), Kind::sheet);
  for (const double x : {-132.0, 132.0}) {
    const Frame fan = facing({x, -326, 278}, {0, 1, 0}, {1, 0, 0});
    a.add("fan ring", revolve({{117, -4}, {120, -4}, {120, 22}, {117, 22}}, 72, Ends::joined), fan);
    a.add("fan hub", revolve({{0, -2}, {36, -2}, {38, 0}, {38, 16}, {34, 20}, {0, 20}}, 56), fan);
    a.add("fan motor", revolve({{0, 20}, {28, 20}, {28, 40}, {24, 44}, {0, 44}}, 48), fan);
    for (int b = 0; b < 7; ++b) {
      const Frame root = rolled(fan, 2 * std::numbers::pi * b / 7);
      std::vector<Line> rings;  // twisted, swept back, thin
      for (int i = 0; i <= 14; ++i) {
        const double r = 34 + 80.0 * i / 14, twist = 0.95 - 0.45 * i / 14,
                     sweep_back = 0.004 * (r - 34) * (r - 34) * 0.6;
        Line ring;
        for (const P2& p : slot(30 + 0.12 * r, 1.4, {0, 0}, twist - std::numbers::pi / 2, 4))
          ring.push_back(root.at({r, p.y - sweep_back * 0.4, 9 + p.x * 0.35}));
        rings.push_back(ring);
      }
      a.add("fan blade", loft(rings, Ends::capped));
    }
    for (int i = 0; i < 3; ++i)
      a.add("fan strut", sweep({rolled(fan, 0.5 + 2 * std::numbers::pi * i / 3).at({26, 0, 30}),
                                rolled(fan, 0.5 + 2 * std::numbers::pi * i / 3).at({120, 0, 14})},
                               rectangle(5, 10, 1.5, 2), {0, 1, 0}, Ends::capped));
  }
}

// A hose with a clamp and a bead at either end.
void add_hose(Assembly& a, const std::string& name, const std::vector<h6Vec3>& through, double r,
              bool corrugated = false) {
  const Line way = smooth(through, corrugated ? 2 : 5);
  const double length = line_length(way);
  const int sides = r > 15 ? 36 : 16;
  a.add(name, corrugated
                  ? rod(
                        way,
                        [=](double s) {
                          const bool cuff = s < 26 || s > length - 26;
                          return cuff ? r : r + 0.09 * r * std::cos(2 * std::numbers::pi * s / 10);
                        },
                        sides)
                  : rod(way, r, sides));
  if (r < 12) return;
  for (const double s : {14.0, length - 14})
    a.add("hose clamp", hose_clamp(r + 0.2), frame_on(way, s));
}

void add_wide_hoses(Assembly& a) {
  add_hose(a, "upper radiator hose",
           {{-296, -340, 440},
            {-296, -300, 444},
            {-270, -262, 452},
            {-246, -160, 430},
            {-238, -96, 424},
            {-225, -60, 428}},
           18);
  a.leave_hole("upper radiator hose", {-268, -262, 470}, 2);
  add_hose(a, "lower radiator hose",
           {{296, -340, 120},
            {296, -296, 116},
            {250, -270, 100},
            {60, -258, 84},
            {-120, -220, 78},
            {-200, -120, 90},
            {-238, -20, 150}},
           19);
  a.leave_hole("lower radiator hose", {60, -258, 103}, 2);
  add_hose(a, "intake hose",
           {{-372, -134, 400},
            {-372, -112, 404},
            {-352, -84, 430},
            {-316, -96, 462},
            {-306, -160, 474},
            {-300, -200, 471},
            {-288, -205, 470},
            {-262, -205, 470}},
           32, true);
  add_hose(a, "fresh air duct",
           {{-372, -318, 335}, {-372, -336, 336}, {-360, -352, 360}, {-340, -360, 420}}, 27, true);
}

void add_thin_hoses(Assembly& a) {
  add_hose(a, "heater hose",
           {{60, 372, 420},
            {60, 340, 424},
            {80, 290, 470},
            {112, 210, 470},
            {110, 160, 440},
            {96, 120, 430}},
           9.5);
  add_hose(a, "heater hose",
           {{110, 372, 420},
            {112, 340, 420},
            {132, 280, 440},
            {140, 180, 430},
            {126, 90, 428},
            {98, 60, 430}},
           9.5);
  add_hose(a, "expansion hose",
           {{320, 290, 420},
            {316, 288, 396},
            {280, 240, 360},
            {240, 60, 380},
            {220, -160, 400},
            {120, -290, 470},
            {-260, -330, 484},
            {-296, -345, 478}},
           7);
  add_hose(a, "vacuum hose",
           {{-180, -205, 505},
            {-186, -180, 530},
            {-230, -60, 560},
            {-250, 120, 560},
            {-280, 240, 520},
            {-286, 290, 500}},
           7);
  add_hose(a, "breather hose",
           {{-205, 130, 534},
            {-210, 150, 556},
            {-270, 120, 570},
            {-330, -40, 540},
            {-356, -100, 470},
            {-362, -128, 440}},
           11, true);
  add_hose(a, "steering hose",
           {{-330, 30, 424}, {-326, 40, 396}, {-290, 90, 360}, {-236, 160, 330}, {-200, 178, 352}},
           9);
  add_hose(a, "air conditioning hose",
           {{-186, -163, 252},
            {-184, -172, 285},
            {-90, -215, 330},
            {60, -250, 330},
            {240, -250, 300},
            {262, -300, 180},
            {250, -335, 150}},
           8);
  add_hose(a, "air conditioning hose",
           {{-220, -163, 252},
            {-222, -175, 280},
            {-200, -230, 320},
            {-180, -290, 380},
            {40, -296, 480},
            {150, -120, 560},
            {180, 200, 520},
            {200, 372, 490}},
           10);
}

}  // namespace

void add_radiator(Assembly& a) {
  add_core(a);
  add_fans(a);
  add_wide_hoses(a);
  add_thin_hoses(a);
}

}  // namespace h6::io::industrial
