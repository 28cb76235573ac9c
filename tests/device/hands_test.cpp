// SPDX-License-Identifier: Apache-2.0
// hands_test.cpp - hands without hardware: one that follows a path exactly, one that yields.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <cmath>
#include <string>

#include "device/path_device.h"
#include "device/simulated_hand.h"
#include "hapsix/vector.h"

using namespace h6;
using namespace h6::device;

namespace {
h6Pose at(double x, double y, double z, double angle = 0) {
  return {{x, y, z}, {std::cos(angle / 2), 0, 0, std::sin(angle / 2)}};
}
HandPath line() {
  return {{0.1, 0.6, 1.1}, {at(0, 0, 0), at(0.01, 0, 0.02), at(0.01, 0.03, 0.02, 1.0)}};
}
}  // namespace

TEST_CASE("a path passes through its rows, straight and evenly between them, still at its ends") {
  const HandPath path = line();
  for (std::size_t i = 0; i < path.time.size(); ++i)
    CHECK(path.at(path.time[i]).pose.p.z == h6::test::near(path.pose[i].p.z));
  CHECK(path.at(-5).pose.p.x == 0);
  CHECK(path.at(0.35).pose.p.x == h6::test::near(0.005));
  CHECK(path.at(99).pose.p.y == h6::test::near(0.03));
  CHECK(path.at(99).velocity.linear.y == 0);
  const h6Quat half = path.at(0.85).pose.q;
  CHECK(2 * std::atan2(half.z, half.w) == h6::test::near(0.5));
}

TEST_CASE("a path's velocity is the derivative of its pose") {
  const HandPath path = line();
  for (double t = 0.15; t < 1.05; t += 0.1) {
    const h6DeviceSample a = path.at(t - 1e-6), b = path.at(t + 1e-6), s = path.at(t);
    CHECK((b.pose.p.y - a.pose.p.y) / 2e-6 == h6::test::near(s.velocity.linear.y).epsilon(1e-6));
    const double turn =
        2 * (std::atan2(b.pose.q.z, b.pose.q.w) - std::atan2(a.pose.q.z, a.pose.q.w)) / 2e-6;
    CHECK(turn == h6::test::near(s.velocity.angular.z).epsilon(1e-5));
  }
}

TEST_CASE("a path goes the short way round whatever the quaternions' signs") {
  HandPath path{{0, 1}, {at(0, 0, 0, 0.2), at(0, 0, 0, 0.6)}};
  h6Quat& q = path.pose[1].q;
  q = -q;
  const h6Quat m = path.at(0.5).pose.q;
  CHECK(std::fabs(2 * std::atan(m.z / m.w)) == h6::test::near(0.4));
  CHECK(path.at(0.5).velocity.angular.z == h6::test::near(0.4));
}

TEST_CASE("paths that are none are refused with a sentence that names the row") {
  CHECK(!PathDevice::open({}));
  HandPath path = line();
  path.time[2] = 0.6;
  CHECK(PathDevice::open(path).error().find("row 3") != std::string::npos);
  path = line();
  path.pose[1].p.x = NAN;
  CHECK(PathDevice::open(path).error().find("row 2") != std::string::npos);
  path = line();
  path.pose[0].q = {0, 0, 0, 0};
  CHECK(PathDevice::open(path).error().find("row 1") != std::string::npos);
  Arm arm;
  arm.mass = 0;
  CHECK(!SimulatedHand::open(line(), arm));
}

TEST_CASE("a person at rest with nothing in the way is where the path is") {
  auto hand = SimulatedHand::open(line(), {});
  REQUIRE(hand);
  const h6Device d = (*hand)->device();
  h6DeviceSample sample{};
  for (int i = 0; i < 5000; ++i) CHECK(d.read(d.self, 1e-3 * i, &sample) == 0);
  CHECK(sample.pose.p.y == h6::test::near(0.03).epsilon(1e-6));
  CHECK(2 * std::atan2(sample.pose.q.z, sample.pose.q.w) == h6::test::near(1.0).epsilon(1e-6));
  CHECK(std::fabs(sample.velocity.linear.y) < 1e-6);
}

TEST_CASE(
    "a person yields to a force by force over stiffness, and comes back when the device stops") {
  Arm arm;
  arm.stiffness = 400;
  auto hand = SimulatedHand::open({{0}, {at(0, 0, 0)}}, arm);
  REQUIRE(hand);
  const h6Device d = (*hand)->device();
  h6DeviceSample sample{};
  h6DeviceCommand push{};
  push.wrench = {{2, 0, 0}, {0, 0, 0.3}};
  int i = 0;
  for (; i < 5000; ++i) {
    d.read(d.self, 1e-3 * i, &sample);
    d.write(d.self, 1e-3 * i, &push);
  }
  CHECK(sample.pose.p.x == h6::test::near(2.0 / 400));
  CHECK(2 * std::atan2(sample.pose.q.z, sample.pose.q.w) ==
        h6::test::near(0.3 / arm.rotational_stiffness));
  d.stop(d.self);
  for (; i < 10000; ++i) {
    d.read(d.self, 1e-3 * i, &sample);
    d.write(d.self, 1e-3 * i, &push);
  }
  CHECK(std::fabs(sample.pose.p.x) < 1e-6);
}

TEST_CASE("the torque turns the hand about the grip, not about the mesh's origin") {
  Arm arm;
  arm.grip = {0.1, 0, 0};
  auto hand = SimulatedHand::open({{0}, {at(0, 0, 0)}}, arm);
  const h6Device d = (*hand)->device();
  h6DeviceSample sample{};
  h6DeviceCommand twist{};
  twist.wrench.torque.z = 0.5;
  for (int i = 0; i < 5000; ++i) {
    d.read(d.self, 1e-3 * i, &sample);
    d.write(d.self, 1e-3 * i, &twist);
  }
  const double angle = 2 * std::atan2(sample.pose.q.z, sample.pose.q.w);
  CHECK(angle > 0.05);
  // The grip itself stays where the path wants it.
  CHECK(sample.pose.p.x + 0.1 * std::cos(angle) == h6::test::near(0.1).epsilon(1e-6));
  CHECK(std::fabs(sample.pose.p.y + 0.1 * std::sin(angle)) < 1e-9);
}

TEST_CASE("a stiff person is stable at any frame length") {
  Arm arm;
  arm.stiffness = 1e6;
  for (const double h : {1e-4, 1e-2, 0.1}) {
    auto hand = SimulatedHand::open(line(), arm);
    const h6Device d = (*hand)->device();
    h6DeviceSample sample{};
    for (int i = 0; i < 300; ++i) {
      d.read(d.self, h * i, &sample);
      REQUIRE(std::fabs(sample.pose.p.x) < 1);
      REQUIRE(std::isfinite(sample.pose.q.w));
    }
  }
}
