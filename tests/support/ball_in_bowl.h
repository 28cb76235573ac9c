// SPDX-License-Identifier: Apache-2.0
// ball_in_bowl.h - many contacts in all directions: a frame with work for every stage.
#pragma once
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"

namespace h6::test {

inline constexpr double kMm = 1e-3;

// A ball pressed into a conforming bowl. It has hundreds of contacts in all directions and rolls.
struct BallInBowl {
  FieldArrays bowl = sample_analytic(
      [](double x, double y, double z) { return 20.2 * kMm - std::sqrt(x * x + y * y + z * z); },
      {-32 * kMm, -32 * kMm, -32 * kMm}, kMm, 8, 8, 8);
  ShellArrays ball;
  Model model;
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  h6Session* session = nullptr;

  explicit BallInBowl(unsigned threads, int points = 30000)
      : ball(sphere_points(20 * kMm, points)), model({def_of(bowl)}, {ball.def()}) {
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    hand.body = 1;
    hand.coupling.max_depth_voxels = 3;  // pressed hard: many contacts
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    def.threads = threads;
  }
  ~BallInBowl() { h6DestroySession(session); }
  void open() {
    h6Error error;
    h6DestroySession(session);
    session = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  // The hand leans on the wall from the first frame on. The sample has values for every device
  // mode.
  h6DeviceSample sample(int i) const {
    const double a = 0.2 * std::sin(0.01 * i), x = std::sin(1.2 + 0.02 * i);
    h6DeviceSample s =
        hand_at(pose(2 * kMm * x, 1.5 * kMm * std::cos(0.013 * i), 1 * kMm * std::sin(0.05 * i)));
    s.pose.q = {std::cos(a), 0, std::sin(a), 0};
    s.wrench.force = {20 * x, 10 * std::cos(0.013 * i), 5 * std::sin(0.05 * i)};
    s.wrench.torque = {0.01, 0.02 * x, 0};
    s.buttons = static_cast<std::uint32_t>(i / 20 % 2);
    return s;
  }
};

}  // namespace h6::test
