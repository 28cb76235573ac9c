// SPDX-License-Identifier: Apache-2.0
// box_on_floor.h - a box on a floor, a hand that holds it, and a few geometric helpers for tests.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "hapsix/hapsix.h"
#include "hapsix/vector.h"
#include "tests/support/analytic.h"

namespace h6::test {

inline constexpr double mm = 1e-3;

using h6::cross, h6::dot, h6::norm, h6::place, h6::operator+, h6::operator-, h6::operator*;
inline h6Quat about(double x, double y, double z, double angle) {  // the axis is unit
  const double s = std::sin(angle / 2);
  return {std::cos(angle / 2), s * x, s * y, s * z};
}
inline bool same_bits(const h6Quat& a, const h6Quat& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}
inline double angle_between(const h6Quat& a, const h6Quat& b) {
  // Computed from the difference, because the arc cosine of the product loses half of the digits.
  const auto from = [&](double sign) {
    return std::hypot(std::hypot(a.w - sign * b.w, a.x - sign * b.x),
                      std::hypot(a.y - sign * b.y, a.z - sign * b.z));
  };
  return 4 * std::asin(std::min(1.0, std::min(from(1), from(-1)) / 2));
}

// A box on a floor z < 0 with 1 mm voxels. The box's centre of mass is not its mesh's origin.
struct BoxOnFloor {
  FieldArrays field = sample_analytic([](double, double, double z) { return z; },
                                      {-64 * mm, -64 * mm, -32 * mm}, mm, 16, 16, 8);
  ShellArrays shell = bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12);
  Model model{{def_of(field)}, {shell.def()}};
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  h6Session* session = nullptr;

  BoxOnFloor() {
    bodies[0].fixed = true;
    bodies[0].field = 0;
    bodies[1].shell = 0;
    bodies[1].pose = pose(0, 0, 5.2 * mm);
    bodies[1].com = {0, 0, 1 * mm};
    const double a = 0.1 / 12 * (400 + 100) * mm * mm, c = 0.1 / 12 * 800 * mm * mm;
    const double inertia[6] = {a, a, c, 0, 0, 0};
    std::copy(inertia, inertia + 6, bodies[1].inertia);
    hand.body = 1;
    hand.safety.soft_start = 0;  // the soft start has its own tests
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
  }
  ~BoxOnFloor() { h6DestroySession(session); }
  void open() {
    h6Error error;
    h6DestroySession(session);
    session = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  h6DeviceCommand hold(const h6DeviceSample& sample, int frames) {
    h6DeviceCommand command{};
    for (int i = 0; i < frames; ++i) h6Step(session, &sample, &command);
    return command;
  }
  h6DeviceCommand hold(const h6Pose& where, int frames) { return hold(hand_at(where), frames); }
  h6BodyState body() const { return h6GetBody(session, 1); }
};

// A hand that turns and goes everywhere, also through the floor and far from the body.
inline h6DeviceSample wild(int i) {
  h6DeviceSample sample = hand_at(
      {{0.03 * std::sin(0.11 * i), 0.02 * std::cos(0.07 * i), 0.005 + 0.03 * std::sin(0.05 * i)},
       about(0.6, 0, 0.8, 2.5 * std::sin(0.031 * i))});
  sample.velocity = {{3 * std::cos(7.0 * i), 2 * std::sin(3.0 * i), -1},
                     {20, -30 * std::sin(1.0 * i), 5}};
  return sample;
}

}  // namespace h6::test
