// SPDX-License-Identifier: Apache-2.0
// alpha_solution.cpp - the alpha puzzle solved: a path without contact that takes the alphas apart.
//
// The alphas are hooked so that each one's crossing lies within the other's loop, and the hand
// unscrews the tool (alpha_solution_path.h). Field, points and hand are those of alpha-shortcut.
// The two scenes together show that an engine that holds the shortcut can still let the tool go.
//
// alpha-shortcut starts elsewhere, with the tool's loop around a single strand. A planner
// (RRT-Connect from both ends, 300,000 samples) found no path between the two starts, not even for
// tubes 0.9 mm thinner. It found one at once for tubes 1.5 mm thinner; tubes fit through the gap
// once they are 1 mm thinner. So the shortcut is likely, but not proved, to be the only way out of
// that start.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "io/scenes/list.h"
#include "io/scenes/paper/alpha.h"
#include "io/scenes/paper/alpha_solution_path.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"

namespace h6::io {
namespace {

constexpr double kPathSpeed = 50 * kMm;  // approximate speed of the tool's fastest point [m/s]
constexpr double kRamp = 0.5;            // time to reach that speed, and to come to rest [s]
constexpr double kTurnArm = 60 * kMm;    // bounds the distance of the tool's points from the x axis
constexpr double kRow = 0.02;            // time between two rows of the path [s]
constexpr int kPieces = 2000;            // pieces by which the path's length is measured

h6Pose pose_of(const AlphaKey& key) {
  const h6Quat facing = from_axes({-1, 0, 0}, {0, 0, -1}, {0, -1, 0});
  const double angle = key.turn * std::numbers::pi / 180;
  return {{key.advance * kMm, 0, 0}, product(turn_by({angle, 0, 0}), facing)};
}

// The slope of the turn at keyframe i is that of the parabola through it and its neighbours.
double slope(std::size_t i) {
  constexpr std::size_t kLast = std::size(kAlphaSolution) - 1;
  const auto between = [](const AlphaKey& a, const AlphaKey& b) {
    return (b.turn - a.turn) / (b.advance - a.advance);
  };
  const AlphaKey* k = kAlphaSolution + i;
  if (i == 0) return between(k[0], k[1]);
  if (i == kLast) return between(k[-1], k[0]);
  const double before = k[0].advance - k[-1].advance, after = k[1].advance - k[0].advance;
  return (after * between(k[-1], k[0]) + before * between(k[0], k[1])) / (before + after);
}

// Interpolates the turn by a cubic Hermite spline over the advance, so that velocities do not jump.
AlphaKey key_at(double advance) {
  const auto next = std::find_if(std::begin(kAlphaSolution) + 1, std::end(kAlphaSolution) - 1,
                                 [&](const AlphaKey& key) { return key.advance >= advance; });
  const AlphaKey &a = next[-1], &b = *next;
  const auto i = static_cast<std::size_t>(next - kAlphaSolution);
  const double span = b.advance - a.advance, t = (advance - a.advance) / span;
  const double u = 1 - t;
  return {advance, u * u * ((1 + 2 * t) * a.turn + t * span * slope(i - 1)) +
                       t * t * ((1 + 2 * u) * b.turn - u * span * slope(i))};
}

// How far the hand has come [m]. Its speed rises and falls as 3 x^2 - 2 x^3 over a ramp.
double travelled(double time, double whole) {
  const auto ramp = [](double x) { return kPathSpeed * kRamp * (x * x * x - x * x * x * x / 2); };
  const double end = whole / kPathSpeed + kRamp;
  if (time < kRamp) return ramp(time / kRamp);
  if (time > end - kRamp) return whole - ramp(std::max(end - time, 0.0) / kRamp);
  return kPathSpeed * (time - kRamp / 2);
}

Path solution_path() {
  const double first = std::begin(kAlphaSolution)->advance;
  const double last = std::rbegin(kAlphaSolution)->advance;
  const auto piece = [&](int i) { return key_at(first + (last - first) * i / kPieces); };
  std::vector<double> along(kPieces + 1, 0.0);  // path length of the fastest point [m]
  for (int i = 1; i <= kPieces; ++i) {
    const AlphaKey a = piece(i - 1), b = piece(i);
    along[i] = along[i - 1] + std::hypot((b.advance - a.advance) * kMm,
                                         kTurnArm * (b.turn - a.turn) * std::numbers::pi / 180);
  }
  HandPath hand(pose_of(piece(0)));
  hand.wait(0.2);
  const int rows = static_cast<int>(std::ceil((along.back() / kPathSpeed + kRamp) / kRow));
  for (int r = 1; r <= rows; ++r) {
    const double way = travelled(r * kRow, along.back());
    const auto next = std::lower_bound(along.begin() + 1, along.end() - 1, way);
    const double fraction = (way - next[-1]) / (next[0] - next[-1]);
    const double i = static_cast<double>(next - along.begin()) - 1 + fraction;
    hand.go_to(pose_of(key_at(first + (last - first) * i / kPieces)), kRow);
  }
  hand.wait(0.5);
  return hand.rows();
}

}  // namespace

Scene alpha_solution() {
  const Path path = solution_path();
  Scene scene = alpha_pair(
      "alpha-solution",
      "The two alphas of alpha-shortcut, hooked together with each one's crossing within the "
      "other's loop, and the way out: the hand pulls the tool along the x axis and turns it about "
      "that axis, so that the gaps pass through each other. Nothing touches: half a millimetre is "
      "left at the tightest place. The tool arrives 150 mm away.",
      path.front().pose);
  scene.hands.push_back(path_hand("tool", path));
  scene.verdict.target = path.back().pose;
  scene.verdict.tolerance = 0.2 * kMm;       // a voxel is 0.22 mm
  scene.verdict.tolerance_angle = 0.2 / 60;  // 0.2 mm at kTurnArm
  return scene;
}

}  // namespace h6::io
