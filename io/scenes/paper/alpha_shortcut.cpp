// SPDX-License-Identifier: Apache-2.0
// alpha_shortcut.cpp - one alpha forced through the gap of the other, and pushed at it in many
// ways.
//
// alpha-shortcut: the tool's loop hangs around the lower strand of the static alpha. The hand
// slides it along that strand like a ring: out of the loop, through the gap, off the tail's free
// end. The way is free everywhere but in the gap; tubes 6 mm thick would pass.
//
// A push leads the tool into the gap in the same way. From there the hand leaves in a direction
// within 30 degrees of the strand's, and turns the tool at random. The bounded coupling pulls the
// tool after it. There is no way out for any turn: see alpha_solution.cpp.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "io/scenes/list.h"
#include "io/scenes/paper/alpha.h"
#include "io/scenes/paper/experiments.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"

namespace h6::io {
namespace {

// A push stays within kPushCone of the strand's direction. The hand goes kPushReach ahead, so far
// that the coupling pulls with its greatest force, and turns the tool kPushTurns times by at most
// kPushTurn.
constexpr double kPushCone = std::numbers::pi / 6, kPushReach = 250 * kMm,
                 kPushTurn = 0.6;  // [rad]
constexpr int kPushTurns = 6;

// The static alpha's lower strand runs from the loop (t = -0.8) through the crossing (t = -1) to
// its tail's end (t = -alpha_end()). The tool stands across it: its tip above the strand, its own
// crossing and tails hanging below.
constexpr double kStart = 0.8;
constexpr double kSpeed = 50 * kMm;  // [m/s]
const double kHalfGap = alpha_point(1).z;

h6Quat tool_orientation() {
  const h6Vec3 u = alpha_outward(), down = {0, 0, -1};
  // Tool axes in the world: x (tip to tails) down, z along the strand, y across it.
  return from_axes(down, cross(u, down), u);
}

h6Pose tool_with_tip_at(const h6Vec3& tip) {
  const h6Quat q = tool_orientation();
  return {tip - rotate(q, alpha_tip()), q};
}

// The place of the tool's tip when the tool has come to t. At the crossing, where the room is
// least, it is midway between the strands; before and behind it stays clear of the lower strand.
h6Vec3 tip_over_strand(double t) {
  const double clear = 9.3 * kMm;
  const double away = std::clamp(std::abs(t - 1) / 0.15, 0.0, 1.0);
  return alpha_point(-t) + h6Vec3{0, 0, kHalfGap + (clear - kHalfGap) * away};
}

Path shortcut_path() {
  HandPath hand(tool_with_tip_at(tip_over_strand(kStart)));
  hand.wait(0.3);
  h6Vec3 tip = tip_over_strand(kStart);
  const auto slide_to = [&](const h6Vec3& next) {
    hand.go_to(tool_with_tip_at(next), norm(next - tip) / kSpeed);
    tip = next;
  };
  constexpr int kSteps = 55;
  for (int i = 1; i <= kSteps; ++i)
    slide_to(tip_over_strand(kStart + (alpha_end() - kStart) * i / kSteps));
  slide_to(tip + 88 * kMm * unit(h6Vec3{1, -1, 0}));

  // The hand twists the tool about each axis in turn while it pulls.
  const h6Pose end = hand.pose();
  constexpr int kTwists = 150;
  for (int i = 1; i <= kTwists; ++i) {
    const double phase = 2 * std::numbers::pi * 3 * i / kTwists;
    const double swing = 0.1 * std::sin(phase);
    const int axis = (i - 1) / (kTwists / 3);
    const h6Vec3 turn = {axis == 0 ? swing : 0, axis == 1 ? swing : 0, axis == 2 ? swing : 0};
    hand.go_to({end.p, product(turn_by(turn), end.q)}, 0.01);
  }
  // A constant force along a frictionless strand makes the tool swing like a pendulum. Only the
  // contacts damp it, with a time constant of two thirds of a second, so it needs this long to
  // settle.
  hand.wait(2.4);
  return hand.rows();
}

std::string millimetres(double metres) {
  const auto hundredths = std::lround(metres / kMm * 100);
  const auto cents = hundredths % 100;
  return std::to_string(hundredths / 100) + "." + (cents < 10 ? "0" : "") + std::to_string(cents) +
         " mm";
}

}  // namespace

Scene alpha_shortcut() {
  const AlphaShape alpha = make_alpha();
  Scene scene = alpha_pair(
      "alpha-shortcut",
      "Two alphas of 1,008 triangles, tube " + millimetres(2 * alpha.tube_radius) +
          " thick, hooked together. The hand slides the tool's loop along a strand of the other, "
          "through the gap between its crossing strands, which is only " +
          millimetres(alpha.gap) +
          " wide, then twists and pulls with 20 N, 3.7 times the force that presses a lone contact "
          "half a voxel deep. Forbidden: a region that no point of the tool reaches while the "
          "loops are "
          "linked.",
      tool_with_tip_at(tip_over_strand(kStart)));
  scene.hands.push_back(path_hand("tool", shortcut_path()));

  // A ring is a loop closed by the straight segment across its gap. While the rings are linked, the
  // static ring crosses the convex hull of the tool's ring. Every point of the tool is then within
  // 117 mm of a point of the static ring; 117 mm is the greatest distance of a point of the tool
  // from a point of its own ring. No point of the static ring is within 120 mm of this box, so a
  // tool that touches the box is no longer linked.
  scene.verdict.forbidden.push_back(
      {{88 * kMm, -300 * kMm, -300 * kMm}, {300 * kMm, -88 * kMm, 300 * kMm}});
  return scene;
}

Path alpha_push(int index) {
  std::mt19937_64 engine(static_cast<std::uint64_t>(index) + 1);
  const auto random = [&] { return static_cast<double>(engine() >> 11) * 0x1p-53; };  // [0, 1)
  // A unit vector whose z is at least least_cosine, uniform on the sphere's cap.
  const auto any_direction = [&](double least_cosine) {
    const double z = 1 - random() * (1 - least_cosine), angle = 2 * std::numbers::pi * random();
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    return h6Vec3{r * std::cos(angle), r * std::sin(angle), z};
  };
  HandPath hand(tool_with_tip_at(tip_over_strand(kStart)));
  hand.wait(0.1);
  h6Vec3 tip = tip_over_strand(kStart);
  for (int i = 1; i <= 20; ++i) {  // to the gap
    const h6Vec3 next = tip_over_strand(kStart + (1 - kStart) * i / 20);
    hand.go_to(tool_with_tip_at(next), norm(next - tip) / kSpeed);
    tip = next;
  }
  const h6Pose gap = hand.pose();
  const h6Vec3 ahead = alpha_outward(), up = {0, 0, 1}, cone = any_direction(std::cos(kPushCone));
  const h6Vec3 way = cone.x * cross(up, ahead) + cone.y * up + cone.z * ahead;
  const h6Vec3 end = gap.p + kPushReach * way;
  for (int i = 0; i < kPushTurns; ++i) {
    const h6Vec3 turn = (kPushTurn * std::cbrt(random())) * any_direction(-1);  // fills a ball
    hand.go_to({end, product(turn_by(turn), gap.q)}, i == 0 ? 0.5 : 0.25);
  }
  hand.wait(0.75);
  return hand.rows();
}

Scene alpha_pushes() {
  Scene scene = alpha_shortcut();
  scene.name = "alpha-pushes";
  scene.hands.front().path = alpha_push(0);
  // A push may end anywhere. While linked, every point of the tool is within 117 mm of the static
  // ring, which lies within -55 mm <= x <= 0, |y| < 17.5 mm, |z| <= 7 mm.
  const double far = 1000 * kMm, x0 = -175 * kMm, x1 = 120 * kMm, y1 = 138 * kMm, z1 = 127 * kMm;
  for (const Box& box :
       {Box{{-far, -far, -far}, {x0, far, far}}, Box{{x1, -far, -far}, {far, far, far}},
        Box{{-far, -far, -far}, {far, -y1, far}}, Box{{-far, y1, -far}, {far, far, far}},
        Box{{-far, -far, -far}, {far, far, -z1}}, Box{{-far, -far, z1}, {far, far, far}}})
    scene.verdict.forbidden.push_back(box);
  return scene;
}

}  // namespace h6::io
