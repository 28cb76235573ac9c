// SPDX-License-Identifier: Apache-2.0
// simulated_arm_test.cpp - a simulated arm and its person, by physics: properties of springs,
// delays, encoders and motors that hold for any figures.
#include "device/simulated_arm.h"
#include "hapsix/vector.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "tests/support/near.h"

using namespace h6;
using namespace h6::device;
using h6::test::near;

namespace {

constexpr double kFrame = 1e-3;

h6Pose at(double x, double y = 0, double z = 0, double angle = 0) {
  return {{x, y, z}, {std::cos(angle / 2), 0, 0, std::sin(angle / 2)}};
}
double angle_of(const h6Pose& pose) { return 2 * std::atan2(pose.q.z, pose.q.w); }

// An arm whose encoders and sensor do not quantise.
ArmFigures ideal() {
  ArmFigures arm;
  arm.position_step = arm.angle_step = arm.force_step = arm.torque_step = 0;
  arm.exact_velocity = true;
  return arm;
}

struct Rig {
  std::unique_ptr<SimulatedArm> arm;
  h6Device device;
  h6DeviceSample sample{};
  h6DeviceCommand command{};
  int frame = 0;

  Rig(HandPath path, const ArmFigures& figures, std::uint32_t mode) {
    command.pose = path.pose.front();
    auto opened = SimulatedArm::open(std::move(path), figures, mode);
    if (!opened) FAIL(opened.error());
    arm = std::move(*opened);
    device = arm->device();
  }
  double time() const { return kFrame * frame; }
  void read() { REQUIRE(device.read(device.self, time(), &sample) == 0); }
  void write() {
    REQUIRE(device.write(device.self, time(), &command) == 0);
    ++frame;
  }
  // Runs frames with the present command, or with the one that `each` makes.
  void run(
      double seconds, const std::function<void()>& each = [] {}) {
    for (const int end = frame + static_cast<int>(seconds / kFrame + 0.5); frame < end;) {
      read();
      each();
      write();
    }
  }
};

HandPath still() { return {{0}, {at(0)}}; }

}  // namespace

TEST_CASE("with nothing in the way the handle follows the path and comes to rest at its end") {
  Rig rig({{0, 1, 2}, {at(0), at(0.05, 0, 0, 0.4), at(0.05, 0.03, 0, 0.4)}}, ideal(), H6_IMPEDANCE);
  double worst = 0;
  rig.run(1, [&] { worst = std::max(worst, std::fabs(rig.sample.pose.p.x - 0.05 * rig.time())); });
  CHECK(worst < 2e-3);  // springs: of the order of v / w at the start, v b / k later
  CHECK(worst > 1e-6);  // the person yields, unlike a rail
  rig.run(4);
  CHECK(rig.sample.pose.p.y == near(0.03).epsilon(1e-6));
  CHECK(angle_of(rig.sample.pose) == near(0.4).epsilon(1e-6));
  CHECK(norm(rig.sample.velocity.linear) < 1e-6);
}

TEST_CASE("a sample's exact velocity is the derivative of its pose") {
  ArmFigures arm = ideal();
  arm.person.grip = {0.05, 0, 0};
  Rig rig({{0, 1}, {at(0), at(0.02, 0.03, 0, 1)}}, arm, H6_IMPEDANCE);
  rig.run(0.5);
  h6DeviceSample last[2] = {};
  rig.run(0.2, [&] {
    if (rig.frame > 510) {
      const double v = (rig.sample.pose.p.y - last[1].pose.p.y) / (2 * kFrame);
      const double w = (angle_of(rig.sample.pose) - angle_of(last[1].pose)) / (2 * kFrame);
      CHECK(last[0].velocity.linear.y == near(v).epsilon(5e-3));
      CHECK(last[0].velocity.angular.z == near(w).epsilon(5e-3));
    }
    last[1] = last[0], last[0] = rig.sample;
  });
}

TEST_CASE("a constant wrench moves the handle by wrench over stiffness of arm and grip in a row") {
  ArmFigures arm = ideal();
  Rig rig(still(), arm, H6_IMPEDANCE);
  rig.command.wrench = {{3, 0, -4}, {0, 0, 0.2}};
  rig.run(5);
  const double give = 1 / arm.person.stiffness + 1 / arm.grip_stiffness;
  CHECK(rig.sample.pose.p.x == near(3 * give).epsilon(1e-6));
  CHECK(rig.sample.pose.p.z == near(-4 * give).epsilon(1e-6));
  CHECK(angle_of(rig.sample.pose) ==
        near(0.2 / arm.person.rotational_stiffness + 0.2 / arm.grip_rotational_stiffness)
            .epsilon(1e-6));
  rig.device.stop(rig.device.self);
  rig.run(5);
  CHECK(norm(rig.sample.pose.p) < 1e-6);
}

TEST_CASE("the torque turns the handle about the grip") {
  ArmFigures arm = ideal();
  arm.person.grip = {0.1, 0, 0};
  Rig rig(still(), arm, H6_IMPEDANCE);
  rig.command.wrench.torque.z = 0.5;
  rig.run(5);
  const double angle = angle_of(rig.sample.pose);
  CHECK(angle > 0.1);
  CHECK(rig.sample.pose.p.x + 0.1 * std::cos(angle) == near(0.1).epsilon(1e-6));
  CHECK(std::fabs(rig.sample.pose.p.y + 0.1 * std::sin(angle)) < 1e-9);
}

TEST_CASE("motors give no more than their rating") {
  ArmFigures arm = ideal();
  arm.max_force = 2, arm.max_torque = 0.1;
  Rig rig(still(), arm, H6_IMPEDANCE);
  rig.command.wrench = {{300, 0, 400}, {0, 0, 5}};
  rig.run(5);
  const double give = 1 / arm.person.stiffness + 1 / arm.grip_stiffness;
  CHECK(norm(rig.sample.pose.p) == near(2 * give).epsilon(1e-6));
  CHECK(rig.device.capabilities.max_force == 2);
}

TEST_CASE("a command is first seen one frame later, plus one frame for each frame of delay") {
  for (const std::uint32_t mode : {H6_IMPEDANCE, H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE})
    for (int delay = 0; delay <= 2; ++delay) {
      CAPTURE(mode);
      CAPTURE(delay);
      ArmFigures arm = ideal();
      arm.delay_frames = delay;
      Rig rig(still(), arm, mode);
      rig.run(0.02);
      rig.read();
      const h6DeviceSample before = rig.sample;
      const h6DeviceCommand calm = rig.command;
      rig.command.wrench.force.x = 20;  // an impulse of one frame
      rig.command.pose.p.x = 0.01;
      rig.write();
      rig.command = calm;
      int seen = 0;
      for (int i = 1; i < 10 && !seen; ++i) {
        rig.read();
        if (norm(rig.sample.velocity.linear) > 1e-9) seen = i;
        rig.write();
      }
      CHECK(norm(before.velocity.linear) < 1e-9);
      CHECK(seen == 1 + delay);
      // The command acts for one frame only: on its own a free mass gains F h / m, less what
      // friction and grip take.
      if (mode != H6_IMPEDANCE) continue;
      const double gained = rig.sample.velocity.linear.x;
      CHECK(gained < 20 * kFrame / arm.mass);
      CHECK(gained > 0.9 * 20 * kFrame / arm.mass);
      rig.read();
      CHECK(rig.sample.velocity.linear.x < gained);
    }
}

TEST_CASE("positions and angles come in whole steps, at most half a step from the truth") {
  ArmFigures coarse = ideal();
  coarse.position_step = 1e-3, coarse.angle_step = 0.02;
  const HandPath path{{0, 1}, {at(0), at(0.02, 0, 0, 0.5)}};
  Rig rig(path, coarse, H6_IMPEDANCE), truth(path, ideal(), H6_IMPEDANCE);
  std::size_t steps = 0;
  double last = 0;
  rig.run(1.5, [&] {
    truth.read();
    truth.write();
    const double x = rig.sample.pose.p.x, counts = x / 1e-3;
    CHECK(std::fabs(counts - std::round(counts)) < 1e-9);
    CHECK(std::fabs(x - truth.sample.pose.p.x) < 0.5e-3 + 1e-9);
    CHECK(std::fabs(angle_of(rig.sample.pose) - angle_of(truth.sample.pose)) < 0.01 + 1e-9);
    steps += x != last, last = x;
  });
  CHECK(steps > 15);
  CHECK(steps < 30);
}

TEST_CASE("a velocity estimated from steps is right on average and rough in detail") {
  ArmFigures arm = ideal();
  arm.exact_velocity = false;
  arm.position_step = 1e-4, arm.angle_step = 1e-3;
  // Speeds whose encoder steps are not in phase with the frames.
  const double v = 0.0517, w = 0.4913;
  Rig rig({{0, 2}, {at(0), at(2 * v, 0, 0, 2 * w)}}, arm, H6_IMPEDANCE);
  rig.run(1);
  double mean = 0, spin = 0, rough = 0;
  rig.run(0.8, [&] {
    mean += rig.sample.velocity.linear.x / 800;
    spin += rig.sample.velocity.angular.z / 800;
    rough = std::max(rough, std::fabs(rig.sample.velocity.linear.x - v));
  });
  CHECK(mean == near(v).epsilon(0.01));
  CHECK(spin == near(w).epsilon(0.01));
  CHECK(rough > 0.01);
}

TEST_CASE("the handle stays in the workspace, however far the person reaches") {
  ArmFigures arm = ideal();
  arm.workspace_min = {-0.02, -0.02, -0.02}, arm.workspace_max = {0.02, 0.02, 0.02};
  Rig rig({{0, 0.3}, {at(0), at(0.2, -0.2, 0)}}, arm, H6_IMPEDANCE);
  rig.run(3);
  const double stiffness = 1 / (1 / arm.person.stiffness + 1 / arm.grip_stiffness);
  const double pressed = 0.18 * stiffness / (arm.stop_stiffness + stiffness);
  CHECK(rig.sample.pose.p.x == near(0.02 + pressed).epsilon(1e-4));
  CHECK(rig.sample.pose.p.y == near(-0.02 - pressed).epsilon(1e-4));
  CHECK(pressed < 4e-3);
}

TEST_CASE("admittance: the handle is at the commanded pose, whatever the person wants") {
  for (const bool real : {false, true}) {
    CAPTURE(real);
    const ArmFigures arm = real ? ArmFigures{} : ideal();
    // The person pulls 20 mm to the other side; the servo's stiffness is m w^2.
    Rig rig({{0, 0.5}, {at(0), at(0, -0.02, 0)}}, arm, H6_ADMITTANCE);
    double worst = 0;
    rig.run(2, [&] {
      if (rig.time() > 0.2)
        worst = std::max(worst, std::fabs(rig.sample.pose.p.x - rig.command.pose.p.x));
      rig.command.pose = at(0.03 * std::sin(3 * rig.time()), 0, 0, 0.2 * std::sin(rig.time()));
      rig.command.velocity.linear.x = 0.09 * std::cos(3 * rig.time());
      rig.command.velocity.angular.z = 0.2 * std::cos(rig.time());
    });
    CHECK(worst < 1e-3);
    CHECK(std::fabs(rig.sample.pose.p.y) < 0.5e-3);
    CHECK(std::fabs(angle_of(rig.sample.pose) - angle_of(rig.command.pose)) < 0.02);
  }
}

TEST_CASE("admittance: a step is taken within a few periods of the servo, with little overshoot") {
  for (const bool real : {false, true}) {
    CAPTURE(real);
    Rig rig(still(), real ? ArmFigures{} : ideal(), H6_ADMITTANCE);
    rig.run(0.01);
    rig.command.pose = at(0.5e-3, 0, 0, 0.01);
    double most = 0, spin = 0, worst = 0;
    const int start = rig.frame;
    rig.run(0.1, [&] {
      most = std::max(most, rig.sample.pose.p.x), spin = std::max(spin, angle_of(rig.sample.pose));
      if (rig.frame > start + 30) worst = std::max(worst, std::fabs(rig.sample.pose.p.x - 0.5e-3));
    });
    CHECK(most < 1.2 * 0.5e-3);
    CHECK(spin < 1.2 * 0.01);
    CHECK(worst < 0.03e-3);
  }
}

TEST_CASE("admittance: the sensor measures what the person pushes with") {
  ArmFigures arm;
  arm.person.grip = {0.1, 0, 0};
  const double twist = 0.1;
  // The person wants to be 10 mm off and turned about the grip; the servo holds the start.
  h6Pose want = at(0, 0.01, 0, twist);
  want.p.x = 0.1 - 0.1 * std::cos(twist), want.p.y -= 0.1 * std::sin(twist);
  Rig rig({{0, 0.5}, {at(0), want}}, arm, H6_ADMITTANCE);
  rig.run(4);
  const double k = 1 / (1 / arm.person.stiffness + 1 / arm.grip_stiffness);
  const double turn = 1 / (1 / arm.person.rotational_stiffness + 1 / arm.grip_rotational_stiffness);
  CHECK(rig.sample.wrench.force.y == near(k * 0.01).epsilon(0.03));  // the servo gives way a little
  CHECK(std::fabs(rig.sample.wrench.force.x) < 0.02);
  CHECK(rig.sample.wrench.torque.z == near(turn * twist).epsilon(0.1));
  const double counts = rig.sample.wrench.force.y / arm.force_step;
  CHECK(std::fabs(counts - std::round(counts)) < 1e-6);
  // With the motors off, the person reaches the goal and pushes against nothing.
  rig.device.stop(rig.device.self);
  rig.run(4);
  CHECK(std::fabs(rig.sample.wrench.force.y) < 2 * arm.force_step);
  CHECK(rig.sample.pose.p.y == near(want.p.y).epsilon(0.01));
}

TEST_CASE("pseudo-admittance: the wrench is the driver's coupling to the commanded pose") {
  ArmFigures arm = ideal();
  arm.driver_stiffness = 800, arm.driver_damping = 7;
  Rig rig({{0, 1}, {at(0), at(0.01, 0, 0, 0.1)}}, arm, H6_PSEUDO_ADMITTANCE);
  double largest = 0;
  rig.run(1.5, [&] {
    const h6DeviceSample& s = rig.sample;
    const h6DeviceCommand& to = rig.command;  // of the last frame: it acted during this one
    const double f =
        800 * (s.pose.p.x - to.pose.p.x) + 7 * (s.velocity.linear.x - to.velocity.linear.x);
    const double t = 800 * 9e-4 * (angle_of(s.pose) - angle_of(to.pose)) +
                     7 * 9e-4 * (s.velocity.angular.z - to.velocity.angular.z);
    CHECK(std::fabs(s.wrench.force.x - f) < 1e-9);
    CHECK(std::fabs(s.wrench.torque.z - t) < 1e-9);
    largest = std::max(largest, std::fabs(f));
    rig.command.pose = at(0.002 * std::sin(20 * rig.time()), 0, 0, 0.05 * rig.time());
    rig.command.velocity.linear.x = 0.04 * std::cos(20 * rig.time());
    rig.command.velocity.angular.z = 0.05;
  });
  CHECK(largest > 1);
  // The motors apply the opposite wrench, which at rest balances the person's springs.
  rig.command.velocity = {};
  rig.command.pose = at(0);
  rig.run(4);
  const double k = 1 / (1 / arm.person.stiffness + 1 / arm.grip_stiffness);
  CHECK(rig.sample.pose.p.x == near(0.01 * k / (k + 800)).epsilon(1e-6));
  CHECK(rig.sample.wrench.force.x == near(k * (0.01 - rig.sample.pose.p.x)).epsilon(1e-6));
}

TEST_CASE("a free swing decays in every mode and for any figures") {
  for (const std::uint32_t mode : {H6_IMPEDANCE, H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE})
    for (const double person : {0.0, 500.0, 1e5})
      for (const double k_dd : {500.0, 4000.0}) {
        CAPTURE(mode);
        CAPTURE(person);
        CAPTURE(k_dd);
        ArmFigures arm;
        arm.person.stiffness = person, arm.person.rotational_stiffness = person / 200;
        arm.person.damping = 0, arm.person.rotational_damping = 0;
        arm.driver_stiffness = k_dd;
        Rig rig(still(), arm, mode);
        rig.command.wrench.force.x = 5;
        rig.command.pose = at(0.005, 0, 0, 0.1);
        rig.run(0.05);
        rig.command.wrench = {};
        rig.command.pose = at(0);
        rig.run(0.1);
        double early = 0, late = 0;
        rig.run(2, [&] { early = std::max(early, norm(rig.sample.velocity.linear)); });
        rig.run(4);
        rig.run(2, [&] { late = std::max(late, norm(rig.sample.velocity.linear)); });
        CHECK(late <= 0.7 * early + 0.05);  // 0.05 m/s: the encoders' own noise
        CHECK(norm(rig.sample.velocity.angular) < 5);
      }
}

TEST_CASE("without any damping a swing never grows") {
  ArmFigures arm = ideal();
  arm.damping = arm.rotational_damping = 0;
  arm.grip_damping = arm.grip_rotational_damping = 0;
  arm.person.damping = arm.person.rotational_damping = 0;
  Rig rig(still(), arm, H6_IMPEDANCE);
  rig.command.wrench = {{5, 0, 0}, {0, 0, 0.1}};
  rig.run(0.05);
  rig.command.wrench = {};
  double first = 0, last = 0, spin_first = 0, spin_last = 0;
  rig.run(2, [&] {
    first = std::max(first, std::fabs(rig.sample.pose.p.x));
    spin_first = std::max(spin_first, std::fabs(angle_of(rig.sample.pose)));
  });
  rig.run(10);
  rig.run(2, [&] {
    last = std::max(last, std::fabs(rig.sample.pose.p.x));
    spin_last = std::max(spin_last, std::fabs(angle_of(rig.sample.pose)));
  });
  CHECK(last < first);
  CHECK(last > 0.5 * first);  // the integration does not damp it away either
  CHECK(spin_last < spin_first);
}

TEST_CASE("figures at the ends of their ranges stay finite and bounded") {
  for (const std::uint32_t mode : {H6_IMPEDANCE, H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE})
    for (int corner = 0; corner < 64; ++corner) {
      CAPTURE(mode);
      CAPTURE(corner);
      const auto pick = [&](int bit, double low, double high) {
        return corner >> bit & 1 ? high : low;
      };
      ArmFigures arm;
      arm.mass = pick(0, 0.01, 100), arm.inertia = pick(0, 1e-5, 10);
      arm.damping = pick(1, 0, 1e4), arm.rotational_damping = pick(1, 0, 100);
      arm.person.stiffness = pick(2, 0, 1e6), arm.person.rotational_stiffness = pick(2, 0, 1e4);
      arm.person.mass = pick(3, 1e-3, 100), arm.person.inertia = pick(3, 1e-6, 10);
      arm.grip_stiffness = pick(4, 0, 1e6), arm.grip_rotational_stiffness = pick(4, 0, 1e4);
      arm.driver_stiffness = 1e5, arm.driver_damping = pick(5, 0.5, 50);
      arm.servo_frequency = pick(5, 1, 200);
      arm.delay_frames = corner % 3;
      Rig rig({{0, 0.1}, {at(0), at(0.01, 0, 0, 0.2)}}, arm, mode);
      rig.command.wrench = {{1, 0, 0}, {0, 0, 0.01}};
      double farthest = 0;
      rig.run(0.5, [&] { farthest = std::max(farthest, norm(rig.sample.pose.p)); });
      CHECK(farthest < 20);  // 1 N on a free mass of 10 g: F t^2 / 2 m = 12.5 m
      CHECK(std::isfinite(rig.sample.pose.q.w + rig.sample.wrench.torque.z));
    }
}

TEST_CASE("the same commands give the same samples, bit for bit") {
  ArmFigures arm;
  arm.delay_frames = 1;
  const HandPath path{{0, 0.4}, {at(0), at(0.02, 0.01, 0, 0.4)}};
  Rig a(path, arm, H6_PSEUDO_ADMITTANCE), b(path, arm, H6_PSEUDO_ADMITTANCE);
  for (int i = 0; i < 500; ++i) {
    for (Rig* rig : {&a, &b}) {
      rig->read();
      rig->command.pose.p.x = 0.4 * rig->sample.pose.p.x;
      rig->write();
    }
    REQUIRE(a.sample.pose.p.x == b.sample.pose.p.x);
    REQUIRE(a.sample.wrench.torque.z == b.sample.wrench.torque.z);
  }
}

TEST_CASE("figures out of range are refused with a sentence that names them") {
  const auto refused = [](const std::function<void(ArmFigures&)>& change,
                          std::uint32_t mode = H6_IMPEDANCE) {
    ArmFigures arm;
    change(arm);
    const auto opened = SimulatedArm::open(still(), arm, mode);
    return opened ? std::string() : opened.error();
  };
  const auto says = [](const std::string& text, const char* part) {
    INFO(text);
    return text.find(part) != std::string::npos;
  };
  CHECK(refused([](ArmFigures&) {}).empty());
  CHECK(says(refused([](ArmFigures& a) { a.mass = 0; }), "mass of the simulated arm is 0"));
  CHECK(says(refused([](ArmFigures& a) { a.inertia = -1; }), "inertia"));
  CHECK(says(refused([](ArmFigures& a) { a.delay_frames = 3; }), "delay"));
  CHECK(says(refused([](ArmFigures& a) { a.delay_frames = -1; }), "delay"));
  CHECK(says(refused([](ArmFigures& a) { a.position_step = -1e-3; }), "position step"));
  CHECK(says(refused([](ArmFigures& a) { a.driver_stiffness = 1e6; }), "driver's stiffness"));
  CHECK(says(refused([](ArmFigures& a) { a.person.mass = 0; }), "person's mass"));
  CHECK(says(refused([](ArmFigures& a) { a.grip_damping = NAN; }), "grip damping"));
  CHECK(says(refused([](ArmFigures& a) { a.max_force = INFINITY; }), "largest force"));
  CHECK(says(refused([](ArmFigures& a) { a.workspace_max.x = 1; }), "workspace"));
  CHECK(says(refused([](ArmFigures& a) { a.person.grip.y = NAN; }), "grip"));
  CHECK(says(refused([](ArmFigures&) {}, 0), "one mode"));
  CHECK(says(refused([](ArmFigures&) {}, H6_IMPEDANCE | H6_ADMITTANCE), "one mode"));
  CHECK(!SimulatedArm::open({}, {}, H6_IMPEDANCE));
}
