// SPDX-License-Identifier: Apache-2.0
// Devices that measure a wrench and follow a pose: admittance and pseudo-admittance, alone and in a
// closed loop with a person and a delay.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <utility>

#include "hapsix/hapsix.h"
#include "tests/support/box_on_floor.h"
#include "tests/support/near.h"

using namespace h6::test;

namespace {

constexpr double ms = 1e-3;

// A box of 0.1 kg on or above a floor z < 0 whose stiffness is k = 1e4 N/m as a whole; 5 N at most.
struct PushedBox : BoxOnFloor {
  h6DeviceCommand told{};

  explicit PushedBox(std::uint32_t mode, double height = 5.2 * mm) {
    bodies[1].pose = pose(0, 0, height);
    bodies[1].com = {0, 0, 0};
    set_mass(0.1);
    hand.mode = mode;
    def.contact.method = H6_METHOD_GAUSS3;
  }
  void set_mass(double mass) {
    const double a = mass / 12 * (400 + 100) * mm * mm, c = mass / 12 * 800 * mm * mm;
    const double inertia[6] = {a, a, c, 0, 0, 0};
    std::copy(inertia, inertia + 6, bodies[1].inertia);
    bodies[1].mass = mass;
  }
  void open() {
    BoxOnFloor::open();
    told.pose = bodies[1].pose;
  }
  // The device is at its commanded pose and is pushed.
  h6Status push(const h6Wrench& wrench, int frames) {
    h6DeviceSample sample{told.pose, told.velocity, 0, wrench, 0, {}};
    for (int i = 0; i < frames; ++i) {
      sample.pose = told.pose;
      h6Step(session, &sample, &told);
    }
    return h6GetFrame(session).status;
  }
  double depth() const { return h6GetFrame(session).max_depth; }
};

h6Wrench force(double x, double y, double z) { return {{x, y, z}, {0, 0, 0}}; }
h6Wrench torque(double x, double y, double z) { return {{0, 0, 0}, {x, y, z}}; }

}  // namespace

TEST_CASE("admittance: however hard the push, the body sinks to F_max/k only") {
  for (const double pushed : {2.0, 50.0, 1e6}) {
    PushedBox scene(H6_ADMITTANCE);
    scene.open();
    const h6Status status = scene.push(force(0, 0, -pushed), 3000);
    const double most = h6GetCoupling(scene.session, 0).max_force;
    CHECK(most == h6::test::near(5));
    CHECK(scene.depth() == h6::test::near(std::min(pushed, most) / 1e4).epsilon(1e-3));
    CHECK(((status & H6_COUPLING_SATURATED) != 0) == (pushed > most));
    CHECK(norm(scene.body().velocity.linear) < 1e-6);
    CHECK(scene.told.pose.p.z == h6::test::near(5 * mm - scene.depth()).epsilon(1e-5));
    CHECK(norm(scene.told.wrench.force) == 0);
  }
}

TEST_CASE("admittance: a twist is bounded by the largest torque") {
  PushedBox scene(H6_ADMITTANCE, 200 * mm);
  scene.hand.coupling.max_torque = 0.01;
  scene.hand.admittance_damping = 50;
  scene.open();
  const h6Status status = scene.push(torque(0, 0, 1e3), 2000);
  CHECK((status & H6_COUPLING_SATURATED) != 0);
  // Damping scales as inertia does to mass, with the ratio of a lever of 50 mm.
  const double inertia = scene.bodies[1].inertia[2];
  CHECK(scene.body().velocity.angular.z ==
        h6::test::near(0.01 / (50 * (inertia / 0.1 + 2.5e-3))).epsilon(1e-6));
}

TEST_CASE("admittance: a free body goes at the speed F/b, and stops when let go") {
  for (const h6Integrator integrator : {H6_IMPLICIT, H6_EXPLICIT})
    for (const double b : {0.0, 2.0, 40.0, 1e5}) {  // explicitly, 1e5 would be far from stable
      PushedBox scene(H6_ADMITTANCE, 100 * mm);
      scene.hand.admittance_damping = b;
      scene.def.integrator = integrator;
      scene.open();
      scene.push(force(0.1, 0.2, 0), 1500);
      const double used = b > 0 ? b : 10;  // 0.1 kg: METHOD.md, Sec. 4
      CAPTURE(b);
      CHECK(scene.body().velocity.linear.x == h6::test::near(0.1 / used).epsilon(1e-6));
      CHECK(scene.body().velocity.linear.y == h6::test::near(0.2 / used).epsilon(1e-6));
      CHECK(scene.told.velocity.linear.x == h6::test::near(0.1 / used).epsilon(1e-6));
      scene.push({}, 2000);
      CHECK(norm(scene.body().velocity.linear) < 1e-9);
      CHECK(norm(scene.told.velocity.linear) < 1e-9);
    }
}

TEST_CASE("admittance: the command is the motion of the mesh frame") {
  PushedBox scene(H6_ADMITTANCE, 100 * mm);
  scene.bodies[1].com = {3 * mm, 0, 4 * mm};
  scene.open();
  double worst = 0, fastest = 0;
  for (int i = 0; i < 400; ++i) {
    const h6Pose before = scene.told.pose;
    scene.push({{0.1 * std::sin(0.01 * i), 0, 0.05}, {1e-4, 2e-4 * std::cos(0.02 * i), 0}}, 1);
    const h6Vec3 v = scene.told.velocity.linear, moved = scene.told.pose.p - before.p;
    if (i > 0) worst = std::max(worst, norm(v - h6Vec3{moved.x / ms, moved.y / ms, moved.z / ms}));
    fastest = std::max(fastest, norm(v));
    CHECK(norm(scene.told.pose.p - scene.body().pose.p) == 0);
    // The safety chain makes the quaternion unit once more.
    CHECK(std::fabs(scene.told.pose.q.x - scene.body().pose.q.x) < 1e-15);
  }
  CHECK(fastest > 0.01);
  // The path of the origin is bent where the body turns: a first-order difference.
  CHECK(worst < 0.02 * fastest);
}

TEST_CASE("a wrench that is not finite counts as none, and the frame reports it") {
  for (const std::uint32_t mode : {H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE})
    for (const double wrong : {static_cast<double>(NAN), HUGE_VAL}) {
      PushedBox scene(mode);
      scene.open();
      h6Wrench wrench = force(0.5, 0, 0);
      wrench.torque.y = wrong;
      CHECK((scene.push(wrench, 50) & H6_HAND_NOT_FINITE) != 0);
      CHECK(norm(scene.told.pose.p - h6Vec3{0, 0, 5.2 * mm}) < 1e-12);
      CHECK((scene.push(force(0.5, 0, 0), 50) & H6_HAND_NOT_FINITE) == 0);
      CHECK(scene.told.pose.p.x > 0.1 * mm);
    }
  // Impedance mode does not read it.
  PushedBox scene(H6_IMPEDANCE);
  scene.open();
  CHECK(scene.push(force(NAN, 0, 0), 5) == H6_OK);
}

TEST_CASE("a few poses that are not finite do not stop an admittance hand, many do") {
  PushedBox scene(H6_ADMITTANCE, 100 * mm);
  scene.open();
  scene.push({}, 1);
  h6DeviceSample sample{scene.told.pose, {}, 0, force(0.5, 0, 0), 0, {}};
  sample.pose.p.x = NAN;
  for (int i = 0; i < 10; ++i) h6Step(scene.session, &sample, &scene.told);
  CHECK((h6GetFrame(scene.session).status & H6_HAND_NOT_FINITE) != 0);
  CHECK(scene.body().velocity.linear.x > 0.02);
  for (int i = 0; i < 200; ++i) h6Step(scene.session, &sample, &scene.told);
  CHECK(scene.told.cause == H6_CAUSE_BAD_SAMPLE);
  CHECK(norm(scene.told.velocity.linear) == 0);
  CHECK(norm(scene.body().velocity.linear) < 1e-6);
}

TEST_CASE("admittance: stable with a stiff person behind 5 ms of delay, free and on the floor") {
  for (const double mass : {0.02, 0.1, 1.0})
    for (const int delay : {0, 2, 5})
      for (const double target : {60 * mm, 2 * mm}) {
        PushedBox scene(H6_ADMITTANCE, target > 10 * mm ? 58 * mm : 5.2 * mm);
        scene.set_mass(mass);
        scene.open();
        // The person feels the handle as it was `delay` frames ago.
        std::deque<double> seen(static_cast<std::size_t>(delay) + 1, scene.told.pose.p.z);
        double speed = 0, swing = 0;
        for (int i = 0; i < 4000; ++i) {
          scene.push(force(0, 0, 500 * (target - seen.front())), 1);
          seen.push_back(scene.told.pose.p.z);
          seen.pop_front();
          if (i < 3500) continue;
          speed = std::max(speed, std::fabs(scene.told.velocity.linear.z));
          swing = std::max(swing, std::fabs(scene.told.pose.p.z - seen.front()));
        }
        CAPTURE(mass);
        CAPTURE(delay);
        CAPTURE(target);
        CHECK(speed < 1e-4);
        CHECK(swing < 1e-6);
        // At rest the person's pull and the floor's push are equal.
        if (target > 10 * mm)
          CHECK(scene.told.pose.p.z == h6::test::near(target).epsilon(1e-5));
        else
          CHECK(500 * (scene.told.pose.p.z - target) ==
                h6::test::near(1e4 * scene.depth()).epsilon(1e-2));
      }
}

TEST_CASE("admittance: stable in the hand's torsion too, however small the part") {
  for (const double mass : {0.005, 0.1})
    for (const int delay : {0, 2, 5}) {
      PushedBox scene(H6_ADMITTANCE, 100 * mm);
      scene.set_mass(mass);
      scene.open();
      std::deque<double> seen(static_cast<std::size_t>(delay) + 1, 0.0);
      for (int i = 0; i < 3000; ++i) {
        scene.push(torque(0, 0, 5 * (0.3 - seen.front())), 1);  // 5 N m/rad, towards 0.3 rad
        seen.push_back(2 * std::atan2(scene.told.pose.q.z, scene.told.pose.q.w));
        seen.pop_front();
      }
      CAPTURE(mass);
      CAPTURE(delay);
      CHECK(norm(scene.told.velocity.angular) < 1e-4);
      CHECK(seen.back() == h6::test::near(0.3).epsilon(1e-4));
    }
}

TEST_CASE("admittance: a body of translations alone feels no twist") {
  PushedBox scene(H6_ADMITTANCE, 100 * mm);
  scene.bodies[1].translation_only = true;
  scene.bodies[1].pose.q = {0.8, 0, 0.6, 0};
  scene.open();
  const h6Quat q = scene.body().pose.q;
  scene.push({{0.5, 0, 0}, {1, 2, 3}}, 200);
  CHECK(scene.body().velocity.linear.x == h6::test::near(0.05).epsilon(1e-3));
  CHECK(norm(scene.body().velocity.angular) == 0);
  CHECK(same_bits(scene.body().pose.q, q));
}

TEST_CASE("a device in fault no longer pushes: its last wrench does not carry the body away") {
  for (const std::uint32_t mode : {H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE}) {
    PushedBox scene(mode, 100 * mm);
    scene.open();
    scene.push(force(0.5, 0, 0), 50);
    CHECK(scene.body().velocity.linear.x > 0.01);
    h6Fault(scene.session, H6_CAUSE_DEVICE_LOST);
    scene.push(force(0.5, 0, 0), 2000);
    CHECK(norm(scene.body().velocity.linear) < 1e-6);
    CHECK(scene.told.cause == H6_CAUSE_DEVICE_LOST);
    CHECK(norm(scene.told.velocity.linear) == 0);
    const h6Pose there = scene.body().pose;
    h6Rearm(scene.session);
    scene.push(force(0.5, 0, 0), 100);
    CHECK(scene.body().pose.p.x > there.p.x + 1 * mm);
    CHECK(scene.told.cause == H6_CAUSE_NONE);
  }
}

TEST_CASE("admittance: where the device cannot follow, the body does not run ahead") {
  for (const std::uint32_t mode : {H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE}) {
    PushedBox scene(mode, 100 * mm);
    scene.hand.admittance_damping = 1;
    scene.open();
    h6DeviceCapabilities slow{};
    slow.max_force = 10, slow.max_torque = 1, slow.max_velocity = 0.1, slow.frame_time = true;
    slow.workspace_min = {-50 * mm, -50 * mm, 0}, slow.workspace_max = {50 * mm, 50 * mm, 200 * mm};
    h6SetRating(scene.session, 0, &slow);
    scene.push(force(0.5, 0, 0), 200);  // would be 0.5 m/s
    CHECK(scene.told.cause == H6_CAUSE_SPEED);
    CHECK(scene.told.pose.p.x == h6::test::near(0.1 * 0.2).epsilon(0.15));
    CHECK(scene.body().pose.p.x == h6::test::near(scene.told.pose.p.x).epsilon(0.02));
    CHECK(scene.body().velocity.linear.x == h6::test::near(0.1).epsilon(0.02));
    scene.push(force(0.5, 0, 0), 2000);  // at the edge of what the device can reach
    CHECK(scene.told.pose.p.x == h6::test::near(50 * mm));
    CHECK(scene.body().pose.p.x < 51 * mm);
    scene.push(force(-0.5, 0, 0), 200);  // and back at once
    CHECK(scene.told.pose.p.x < 45 * mm);
  }
}

TEST_CASE("pseudo-admittance: manipulandum and body start together, and stay when nothing pulls") {
  PushedBox scene(H6_PSEUDO_ADMITTANCE);
  scene.bodies[1].pose.q = {0.8, 0, 0.6, 0};
  scene.bodies[1].com = {1 * mm, 2 * mm, 3 * mm};
  scene.bodies[1].pose.p.z = 100 * mm;
  scene.open();
  scene.push({}, 100);
  CHECK(norm(scene.told.pose.p - h6Vec3{0, 0, 100 * mm}) < 1e-15);
  CHECK(norm(scene.body().pose.p - h6Vec3{0, 0, 100 * mm}) < 1e-15);
  CHECK(norm(scene.told.velocity.linear) == 0);
}

namespace {

// A device with mass, held by a person's spring and damper and coupled by its driver to the
// manipulandum. The driver knows the command of `delay` frames ago.
struct HeldDevice {
  double mass = 0.2, person_k = 300, person_b = 5;
  double k_dd = 1e3, b_dd = 4;
  int delay = 0;
  double x = 5.2 * mm, v = 0;
  std::deque<std::pair<double, double>> known;  // pose and velocity of the manipulandum

  double pull() const {
    const auto [xm, vm] = known.front();
    return k_dd * (xm - x) + b_dd * (vm - v);
  }
  // One frame: the driver's force is held, the person acts all the time.
  h6DeviceSample sample() const {
    h6DeviceSample s = hand_at(pose(0, 0, x));
    s.velocity.linear.z = v;
    s.wrench.force.z = -pull();
    return s;
  }
  void move(double target, const h6DeviceCommand& told) {
    known.push_back({told.pose.p.z, told.velocity.linear.z});
    known.pop_front();
    const int slices = 10;
    for (int i = 0; i < slices; ++i) {
      // The driver's loop is fast: it feels the device now.
      const double f = pull() + person_k * (target - x) - person_b * v;
      v += ms / slices * f / mass;
      x += ms / slices * v;
    }
  }
  void tie(double at) { known.assign(static_cast<std::size_t>(delay) + 1, {at, 0.0}); }
};

}  // namespace

TEST_CASE(
    "pseudo-admittance: stable against a wall for every driver, and at rest all forces agree") {
  for (const double k_dd : {5e2, 1e3, 4e3})
    for (const double b_dd : {0.0, 4.0, 12.0})
      for (const double m : {0.01, 0.1, 1.0})
        for (const int delay : {0, 1, 2}) {
          PushedBox scene(H6_PSEUDO_ADMITTANCE);
          scene.hand.manipulandum_mass = m;
          scene.hand.driver_stiffness = k_dd;
          scene.hand.driver_damping = b_dd;
          scene.open();
          HeldDevice device;
          device.k_dd = k_dd, device.b_dd = b_dd, device.delay = delay;
          device.tie(5.2 * mm);
          // 3 mm into the floor, slowly enough that nothing saturates on the way.
          const double target = 2 * mm;
          double speed = 0, most = 0;
          for (int i = 0; i < 5000; ++i) {
            const h6DeviceSample sample = device.sample();
            h6Step(scene.session, &sample, &scene.told);
            device.move(5.2 * mm + (target - 5.2 * mm) * std::min(1.0, i / 1000.0), scene.told);
            most = std::max(most, scene.depth());
            if (i > 4500)
              speed =
                  std::max({speed, std::fabs(device.v), std::fabs(scene.told.velocity.linear.z)});
          }
          CAPTURE(k_dd);
          CAPTURE(b_dd);
          CAPTURE(m);
          CAPTURE(delay);
          CHECK(speed < 1e-5);
          CHECK(most < 0.5 * mm);
          const double person = device.person_k * (device.x - target), felt = device.pull();
          CHECK(person > 0.4);
          CHECK(felt == h6::test::near(person).epsilon(1e-2));
          CHECK(1e4 * scene.depth() == h6::test::near(person).epsilon(1e-2));
        }
}

TEST_CASE("pseudo-admittance: in free motion nothing drags") {
  // A device that moves at a steady speed: driver, manipulandum and body follow without a force.
  PushedBox scene(H6_PSEUDO_ADMITTANCE, 100 * mm);
  scene.hand.driver_stiffness = 4e3;
  scene.hand.driver_damping = 12;
  scene.open();
  double x = 0, pull = 0;
  h6DeviceSample sample = hand_at(pose(0, 0, 100 * mm));
  for (int i = 0; i < 3000; ++i) {
    x += 0.1 * ms;
    sample.pose.p.x = x, sample.velocity.linear.x = 0.1;
    pull = 4e3 * (x - scene.told.pose.p.x - 0.1 * ms) + 12 * (0.1 - scene.told.velocity.linear.x);
    sample.wrench.force.x = pull;
    h6Step(scene.session, &sample, &scene.told);
  }
  CHECK(scene.body().velocity.linear.x == h6::test::near(0.1).epsilon(1e-6));
  CHECK(scene.told.velocity.linear.x == h6::test::near(0.1).epsilon(1e-6));
  CHECK(std::fabs(pull) < 1e-5);
}

TEST_CASE(
    "pseudo-admittance: what a push moves is body, manipulandum and a frame's coupling damping") {
  for (const double m : {0.02, 0.1, 0.5}) {
    PushedBox scene(H6_PSEUDO_ADMITTANCE, 500 * mm);
    scene.hand.manipulandum_mass = m;
    scene.open();
    scene.push(force(0.2, 0, 0), 50);
    scene.push({}, 2000);
    CAPTURE(m);
    const double b = 2 * std::sqrt(1e3 * 0.1);  // critical damping of the body
    CHECK(scene.body().velocity.linear.x ==
          h6::test::near(0.2 * 0.05 / (0.1 + m + 1e-3 * b)).epsilon(0.02));
    CHECK(scene.told.velocity.linear.x ==
          h6::test::near(scene.body().velocity.linear.x).epsilon(1e-3));
  }
}

TEST_CASE(
    "pseudo-admittance: the coupling's force on the body is bounded however far the hand goes") {
  PushedBox scene(H6_PSEUDO_ADMITTANCE);
  scene.hand.driver_stiffness = 1e3;
  scene.hand.driver_damping = 12;
  scene.open();
  HeldDevice device;
  device.b_dd = 12, device.person_k = 2000, device.person_b = 20;
  device.tie(5.2 * mm);
  bool saturated = false;
  double felt = 0;
  for (int i = 0; i < 6000; ++i) {
    const h6DeviceSample sample = device.sample();
    h6Step(scene.session, &sample, &scene.told);
    device.move(-20 * mm, scene.told);
    felt = device.pull();
    saturated = saturated || (h6GetFrame(scene.session).status & H6_COUPLING_SATURATED) != 0;
    CHECK(std::isfinite(felt));
  }
  CHECK(saturated);
  CHECK(scene.depth() == h6::test::near(0.5 * mm).epsilon(0.01));
  CHECK(felt == h6::test::near(5).epsilon(0.01));  // and so does the person
}

TEST_CASE(
    "pseudo-admittance: hands can turn the body, and a body of translations alone they cannot") {
  for (const bool translation_only : {false, true})
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
      PushedBox scene(H6_PSEUDO_ADMITTANCE, 100 * mm);
      scene.bodies[1].translation_only = translation_only;
      scene.def.gradient = gradient;
      scene.hand.driver_stiffness = 1e3, scene.hand.driver_damping = 4;
      scene.open();
      // A driver whose device is held turned by 0.5 rad about z: 0.9 N m/rad, 4e-3 N m s/rad.
      h6DeviceSample sample = hand_at({{0, 0, 100 * mm}, {std::cos(0.25), 0, 0, std::sin(0.25)}});
      for (int i = 0; i < 4000; ++i) {
        const h6Quat& q = scene.told.pose.q;
        const double angle = 2 * std::atan2(q.z, q.w);
        sample.wrench = torque(0, 0, 0.9 * (0.5 - angle) - 4e-3 * scene.told.velocity.angular.z);
        h6Step(scene.session, &sample, &scene.told);
      }
      CHECK(scene.body().pose.q.z ==
            h6::test::near(translation_only ? 0 : std::sin(0.25)).epsilon(1e-4));
      CHECK(scene.told.pose.q.z ==
            h6::test::near(translation_only ? 0 : std::sin(0.25)).epsilon(1e-4));
      CHECK(norm(scene.body().velocity.angular) < 1e-6);
    }
}

TEST_CASE("a teleport takes the manipulandum along, and the state hash contains it") {
  PushedBox scene(H6_PSEUDO_ADMITTANCE, 100 * mm);
  scene.open();
  scene.push(force(0.5, 0, 0), 30);
  const h6BodyState there{pose(20 * mm, 0, 50 * mm), {}};
  h6SetBody(scene.session, 1, &there);
  h6DeviceSample sample = hand_at(there.pose);
  for (int i = 0; i < 20; ++i) h6Step(scene.session, &sample, &scene.told);
  CHECK(norm(scene.body().pose.p - there.pose.p) < 1e-12);
  CHECK(norm(scene.body().velocity.linear) < 1e-12);
  // One frame of two pushes: the bodies are where they were, only the manipulanda differ.
  const auto hash_after = [](double mass) {
    PushedBox pushed(H6_PSEUDO_ADMITTANCE, 100 * mm);
    pushed.hand.manipulandum_mass = mass;
    pushed.hand.coupling.damping_ratio = 0;
    pushed.hand.coupling.stiffness = 1e-300;
    pushed.hand.coupling.rotational_stiffness = 1e-300;
    pushed.open();
    pushed.push(force(0.5, 0, 0), 1);
    CHECK(norm(pushed.body().pose.p - h6Vec3{0, 0, 100 * mm}) < 1e-15);
    return h6GetFrame(pushed.session).state_hash;
  };
  CHECK(hash_after(0.1) == hash_after(0.1));
  CHECK(hash_after(0.1) != hash_after(0.2));
}

TEST_CASE("under any stream of wrenches body and manipulandum stay finite") {
  for (const std::uint32_t mode : {H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE}) {
    PushedBox scene(mode);
    scene.open();
    const double values[] = {0, NAN, 1e3, -HUGE_VAL, 1e300, -1e300, 1e-310, 3};
    for (int i = 0; i < 400; ++i) {
      h6Wrench w{{values[i % 8], values[(i / 8) % 8], values[(i / 3) % 8]},
                 {values[(i / 5) % 8], values[(i / 7) % 8], values[(i / 2) % 8]}};
      scene.push(w, 1);
      const h6BodyState b = scene.body();
      for (const double v : {b.pose.p.x, b.pose.q.w, b.velocity.linear.z, b.velocity.angular.y,
                             scene.told.pose.p.y, scene.told.velocity.linear.x})
        CHECK(std::isfinite(v));
    }
  }
}

TEST_CASE("invalid device modes are refused with a sentence that names the value") {
  const auto complaint_of = [](std::uint32_t mode, const std::function<void(PushedBox&)>& spoil) {
    PushedBox scene(mode);
    spoil(scene);
    h6Error error{};
    h6Session* session = h6CreateSession(scene.model.handle, &scene.def, &error);
    const std::string text = session ? "" : error.message;
    h6DestroySession(session);
    return text;
  };
  for (const std::uint32_t mode : {H6_IMPEDANCE, H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE})
    CHECK(complaint_of(mode, [](PushedBox&) {}) == "");
  for (const std::uint32_t mode : {0u, 3u, 5u, 8u, 0xffffffffu})
    CHECK(complaint_of(mode, [](PushedBox&) {}).find("hand 0: mode ") != std::string::npos);
  struct Value {
    const char* name;
    double h6HandDef::*value;
    bool zero_is_wrong;
  };
  for (const Value& v : {Value{"manipulandum_mass", &h6HandDef::manipulandum_mass, true},
                         Value{"driver_stiffness", &h6HandDef::driver_stiffness, false},
                         Value{"driver_damping", &h6HandDef::driver_damping, false},
                         Value{"admittance_damping", &h6HandDef::admittance_damping, false}})
    for (const double wrong : {-1.0, static_cast<double>(NAN), HUGE_VAL, 0.0}) {
      const std::string text =
          complaint_of(H6_PSEUDO_ADMITTANCE, [&](PushedBox& s) { s.hand.*v.value = wrong; });
      const bool named = text.find(v.name) != std::string::npos;
      CHECK_MESSAGE(named == (wrong != 0 || v.zero_is_wrong), v.name, " ", wrong, ": ", text);
    }
  for (const auto& [name, value] : {std::pair{"motion_scale", &h6HandFilterDef::motion_scale},
                                    std::pair{"rotation_scale", &h6HandFilterDef::rotation_scale},
                                    std::pair{"force_scale", &h6HandFilterDef::force_scale}})
    for (const double wrong : {-1.0, static_cast<double>(NAN), HUGE_VAL, 0.0}) {
      const std::string text =
          complaint_of(H6_IMPEDANCE, [&, v = value](PushedBox& s) { s.hand.filter.*v = wrong; });
      CHECK_MESSAGE(text.find(name) != std::string::npos, name, " ", wrong, ": ", text);
    }
}

TEST_CASE("a loop refuses a device that does not offer the hand's mode") {
  for (const std::uint32_t mode : {H6_IMPEDANCE, H6_ADMITTANCE, H6_PSEUDO_ADMITTANCE})
    for (const std::uint32_t offered :
         {std::uint32_t{0}, std::uint32_t{H6_IMPEDANCE}, std::uint32_t{H6_ADMITTANCE},
          std::uint32_t{H6_IMPEDANCE | H6_PSEUDO_ADMITTANCE}}) {
      PushedBox scene(mode);
      scene.open();
      h6Device device{};
      device.capabilities.max_force = 10, device.capabilities.max_torque = 1;
      device.capabilities.modes = offered;
      device.read = [](void*, double, h6DeviceSample* out) {
        *out = hand_at(pose(0, 0, 5.2 * mm));
        return 0;
      };
      device.write = [](void*, double, const h6DeviceCommand*) { return 0; };
      h6LoopDef def = h6DefaultLoopDef();
      def.virtual_time = true, def.realtime = false, def.duration = 0.002, def.ring_frames = 0;
      h6Error error{};
      h6Loop* loop = h6StartLoop(scene.session, &device, &def, &error);
      const std::uint32_t meant = offered ? offered : std::uint32_t{H6_IMPEDANCE};
      CAPTURE(mode);
      CAPTURE(offered);
      CHECK((loop != nullptr) == ((meant & mode) != 0));
      if (loop) {
        h6JoinLoop(loop, nullptr);
        h6DestroyLoop(loop);
      } else {
        CHECK(std::string(error.message).find("mode") != std::string::npos);
      }
    }
}
