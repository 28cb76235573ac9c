// SPDX-License-Identifier: Apache-2.0
// The coupling between hand and body: dynamic, quasi-static or direct.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <string>
#include <utility>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"
#include "tests/support/box_on_floor.h"
#include "tests/support/near.h"

using namespace h6::test;

TEST_CASE("a quasi-static body rests where a dynamic one comes to rest") {
  for (const h6Method method :
       {H6_METHOD_NONE, H6_METHOD_GLOBAL, H6_METHOD_GAUSS3, H6_METHOD_SERIES})
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT})
      for (const double z : {4.0, -20.0}) {  // within the coupling's bound, and far beyond
        // Turned about the vertical as well, and less across: the box stays on all of its points.
        const h6Pose held{{3 * mm, -2 * mm, z * mm}, about(0.1, 0, std::sqrt(0.99), 0.1)};
        const auto rest = [&](h6CouplingMode mode, int frames) {
          BoxOnFloor scene;
          scene.def.contact.method = method;
          scene.def.gradient = gradient;
          scene.hand.coupling.mode = mode;
          scene.open();
          const h6DeviceCommand felt = scene.hold(held, frames);
          return std::pair{scene.body(), felt.wrench};
        };
        CAPTURE(h6MethodName(method));
        CAPTURE(static_cast<int>(gradient));
        CAPTURE(z);
        const auto [moving, felt_moving] = rest(H6_COUPLING_DYNAMIC, 6000);
        const auto [at_rest, felt_at_rest] = rest(H6_COUPLING_STATIC, 400);
        // Shares of `global` jump with the number of contacts, so near each rest there are others.
        const double loose = method == H6_METHOD_GLOBAL ? 3 : 1;
        CHECK(norm(moving.pose.p - at_rest.pose.p) < 1e-7 * loose);
        CHECK(angle_between(moving.pose.q, at_rest.pose.q) < 1e-5 * loose);
        CHECK(norm(felt_moving.force - felt_at_rest.force) < 1e-3);
        CHECK(norm(felt_moving.torque - felt_at_rest.torque) < 1e-5 * loose);
        CHECK(norm(felt_at_rest.force) > 0.5);
      }
}

TEST_CASE("a quasi-static body has no velocity and takes no step longer than its bound") {
  for (const double most : {0.5, 0.1})
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
      BoxOnFloor scene;
      scene.hand.coupling.mode = H6_COUPLING_STATIC;
      scene.hand.coupling.max_step_voxels = most;
      scene.def.gradient = gradient;
      scene.open();
      double longest = 0;
      for (int i = 0; i < 1500; ++i) {
        const h6Pose before = scene.body().pose;
        scene.hold(wild(i), 1);
        const h6BodyState after = scene.body();
        CHECK(norm(after.velocity.linear) == 0);
        CHECK(norm(after.velocity.angular) == 0);
        const double outermost = 10 * mm * 11 / 12;
        for (const double x : {-outermost, outermost})
          for (const double y : {-outermost, outermost}) {
            const h6Vec3 corner{x, y, -5 * mm};
            longest = std::max(longest, norm(place(after.pose, corner) - place(before, corner)));
          }
      }
      CHECK(longest <= most * mm * (1 + 1e-9));
      CHECK(longest > 0.5 * most * mm);
    }
}

TEST_CASE("the force of a quasi-static hand never exceeds its saturation") {
  BoxOnFloor scene;
  scene.hand.coupling.mode = H6_COUPLING_STATIC;
  scene.open();
  const h6CouplingDef c = h6GetCoupling(scene.session, 0);
  bool saturated = false;
  for (int i = 0; i < 1500; ++i) {
    const h6DeviceCommand felt = scene.hold(wild(i), 1);
    CHECK(norm(felt.wrench.force) <= c.max_force * (1 + 1e-9));
    CHECK(norm(felt.wrench.torque) <= c.max_torque * (1 + 1e-9));
    saturated = saturated || (h6GetFrame(scene.session).status & H6_COUPLING_SATURATED) != 0;
  }
  CHECK(saturated);
}

TEST_CASE("in free space a quasi-static body reaches the hand, saturated and far turned too") {
  for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT})
    for (const double angle : {0.2, 2.0, 3.1}) {
      BoxOnFloor scene;
      scene.hand.coupling.mode = H6_COUPLING_STATIC;
      scene.def.gradient = gradient;
      scene.open();
      const h6Pose target{{30 * mm, -20 * mm, 80 * mm}, about(0.48, 0.6, 0.64, angle)};
      scene.hold(target, 1);
      CHECK((h6GetFrame(scene.session).status & H6_COUPLING_SATURATED) != 0);
      const h6DeviceCommand felt = scene.hold(target, 400);
      CAPTURE(angle);
      CHECK(norm(scene.body().pose.p - target.p) < 1e-9);
      CHECK(angle_between(scene.body().pose.q, target.q) < 1e-8);
      CHECK(norm(felt.wrench.force) < 1e-6);
    }
}

TEST_CASE("a free quasi-static body comes a quarter nearer to the hand in each frame") {
  const h6Vec3 target{0.1 * mm, 0.2 * mm, 5.5 * mm};
  for (const double ratio : {0.0, 1.0}) {  // without damping it is there at once
    BoxOnFloor scene;
    scene.hand.coupling.mode = H6_COUPLING_STATIC;
    scene.hand.coupling.damping_ratio = ratio;
    scene.open();
    double away = norm(scene.body().pose.p - target);
    for (int i = 0; i < 10; ++i) {
      scene.hold(h6Pose{target, {1, 0, 0, 0}}, 1);
      away *= ratio == 0 ? 0 : 0.75;
      CHECK(norm(scene.body().pose.p - target) == near(away).epsilon(1e-9));
    }
  }
}

TEST_CASE("a free quasi-static body that moves with the hand feels no damper") {
  // The hand feels how far it is ahead in each frame, and nothing else.
  for (const double ratio : {0.0, 1.0}) {
    BoxOnFloor scene;
    scene.hand.coupling.mode = H6_COUPLING_STATIC;
    scene.hand.coupling.damping_ratio = ratio;
    scene.open();
    h6DeviceCommand felt{};
    for (int i = 0; i < 300; ++i) {
      h6DeviceSample sample = hand_at(pose(0.05 * mm * i, 0, 50 * mm));
      sample.velocity.linear.x = 0.05;
      felt = scene.hold(sample, 1);
    }
    CHECK(felt.wrench.force.x == near(-1e3 * 0.05 * mm).epsilon(1e-6));
  }
}

namespace {

// A handle of 0.3 kg that a soft person presses onto a floor, and whose commands come late.
struct LateHandle {
  double z = 6 * mm, v = 0;
  std::array<double, 3> force{};  // newest first
  void move(double felt, int delay, double wanted) {
    force = {felt, force[0], force[1]};
    for (int i = 0; i < 10; ++i) {
      v += 1e-4 / 0.3 * (force[static_cast<std::size_t>(delay)] + 400 * (wanted - z) - 8 * v);
      z += 1e-4 * v;
    }
  }
};

// How far the handle still swings after two seconds of pressing 3 mm deep [m].
double swing_of(double k_vc, int delay, double damping_ratio) {
  BoxOnFloor scene;
  scene.bodies[1].com = {0, 0, 0};
  scene.def.contact.stiffness = 1e5;
  scene.def.contact.method = H6_METHOD_GAUSS3;
  scene.hand.coupling.mode = H6_COUPLING_STATIC;
  scene.hand.coupling.stiffness = k_vc;
  scene.hand.coupling.damping_ratio = damping_ratio;
  scene.open();
  LateHandle handle;
  double low = 1, high = -1;
  for (int i = 0; i < 2500; ++i) {
    h6DeviceSample sample = hand_at(pose(0, 0, handle.z));
    sample.velocity.linear.z = handle.v;
    handle.move(scene.hold(sample, 1).wrench.force.z, delay,
                std::max(2 * mm, 6 * mm - i * 1e-3 * 10 * mm));
    if (i >= 2000) low = std::min(low, handle.z), high = std::max(high, handle.z);
  }
  return high - low;
}

}  // namespace

TEST_CASE("a stiff quasi-static hand rests on a wall although its commands come late") {
  for (const double k : {1e3, 5e3, 1e4, 1.5e4})
    for (const int delay : {0, 1, 2}) {
      CAPTURE(k);
      CAPTURE(delay);
      CHECK(swing_of(k, delay, 1) < 1e-6);
    }
  CHECK(swing_of(1e4, 2, 0) > 1e-4);  // the damper is what brings it to rest
}

TEST_CASE("before the first good sample a quasi-static and a direct body stay where they are") {
  for (const h6CouplingMode mode : {H6_COUPLING_STATIC, H6_COUPLING_DIRECT}) {
    BoxOnFloor scene;
    scene.hand.coupling.mode = mode;
    scene.bodies[1].velocity.linear.x = 1;
    scene.open();
    h6DeviceSample nothing = hand_at(pose(1, 2, 3));
    nothing.pose.p.y = NAN;
    const h6DeviceCommand felt = scene.hold(nothing, 5);
    CHECK(norm(scene.body().pose.p - h6Vec3{0, 0, 5.2 * mm}) < 1e-15);
    CHECK(norm(scene.body().velocity.linear) == 0);
    CHECK(norm(felt.wrench.force) == 0);
    CHECK((h6GetFrame(scene.session).status & H6_HAND_NOT_FINITE) != 0);
  }
}

TEST_CASE("a direct body is where the hand is, and moves as it moves") {
  BoxOnFloor scene;
  scene.hand.coupling.mode = H6_COUPLING_DIRECT;
  scene.def.max_substeps = 1;  // with substeps it stays behind so fast a hand
  scene.open();
  for (int i = 0; i < 50; ++i) {
    const h6DeviceSample sample = wild(i);
    scene.hold(sample, 1);
    const h6BodyState state = scene.body();
    CHECK(norm(state.pose.p - sample.pose.p) < 1e-16);
    CHECK(angle_between(state.pose.q, sample.pose.q) < 1e-14);
    // The velocity of the centre of mass: the origin's, and the part of the rotation.
    const h6Vec3 lever = place(sample.pose, {0, 0, 1 * mm}) - sample.pose.p;
    const h6Vec3 turning = cross(sample.velocity.angular, lever);
    CHECK(norm(state.velocity.linear - sample.velocity.linear - turning) < 1e-14);
    CHECK(norm(state.velocity.angular - sample.velocity.angular) == 0);
  }
}

TEST_CASE("a direct hand feels the contacts of its own pose, in the same frame") {
  for (const h6Method method : {H6_METHOD_GAUSS3, H6_METHOD_ROBUST, H6_METHOD_SERIES}) {
    BoxOnFloor scene;
    scene.def.contact.method = method;
    scene.hand.coupling.mode = H6_COUPLING_DIRECT;
    scene.def.max_substeps = 1;  // it jumps onto the floor
    scene.open();
    h6DeviceCapabilities any{};
    any.max_force = 100, any.max_torque = 10, any.max_force_rate = 1e9, any.max_torque_rate = 1e9;
    h6SetRating(scene.session, 0, &any);
    // First far away, then at once inside, tilted: 20 000 N/s are 20 N in a frame.
    scene.hold(pose(0, 0, 20 * mm), 1);
    const h6DeviceCommand felt = scene.hold({{1 * mm, 2 * mm, 4.6 * mm}, about(0, 1, 0, 0.03)}, 1);
    const h6Contacts c = h6GetContacts(scene.session, 1);
    REQUIRE(c.count > 10);
    h6Vec3 force{}, torque{};
    for (std::size_t i = 0; i < c.count; ++i) {
      const double f = 1e4 * c.load[i];
      const h6Vec3 F{f * c.nx[i], f * c.ny[i], f * c.nz[i]};
      const h6Vec3 T = cross({c.rx[i], c.ry[i], c.rz[i]}, F);
      force = {force.x + F.x, force.y + F.y, force.z + F.z};
      torque = {torque.x + T.x, torque.y + T.y, torque.z + T.z};
    }
    CAPTURE(h6MethodName(method));
    CHECK(norm(force) > 0.5);
    CHECK(norm(torque) > 1e-3);
    CHECK(norm(felt.wrench.force - force) < 1e-5 * norm(force));
    CHECK(norm(felt.wrench.torque - torque) < 1e-5 * norm(torque));
  }
}

TEST_CASE("a direct body stays, at rest, while its hand sends no numbers, or huge ones") {
  BoxOnFloor scene;
  scene.hand.coupling.mode = H6_COUPLING_DIRECT;
  scene.open();
  h6DeviceSample sample = hand_at(pose(1 * mm, 0, 4.8 * mm));
  sample.velocity.linear.x = 0.5;
  scene.hold(sample, 1);
  CHECK(scene.body().velocity.linear.x == h6::test::near(0.5));
  sample.pose.q.x = NAN;
  sample.pose.p.x = 7 * mm;
  scene.hold(sample, 3);
  CHECK(scene.body().pose.p.x == h6::test::near(1 * mm));
  CHECK(norm(scene.body().velocity.linear) == 0);
  for (const double huge : {1e9, 1e30, 1e200, -1e300}) {
    const h6DeviceCommand felt = scene.hold(pose(huge, -huge, huge), 2);
    CHECK(std::isfinite(felt.wrench.force.x));
    CHECK(scene.body().pose.p.x == h6::test::near(1 * mm));
  }
  h6Rearm(scene.session);
  CHECK(norm(scene.hold(pose(0, 0, 4.8 * mm), 10).wrench.force) > 0.5);
}

TEST_CASE("a body that other hands push feels a direct one as a moving wall") {
  // A box with a shell, held by a dynamic hand, against a ball with a field that a direct hand
  // carries into it.
  FieldArrays ball = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 20 * mm; },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  ShellArrays box = bottom_face(10 * mm, 10 * mm, 5 * mm, 20, 20);
  Model model({def_of(ball)}, {box.def()});
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].field = 0, bodies[0].inertia[0] = bodies[0].inertia[1] = bodies[0].inertia[2] = 1e-5;
  bodies[1].shell = 0, bodies[1].pose = pose(0, 0, 26 * mm);
  std::array<h6HandDef, 2> hands{h6DefaultHandDef(), h6DefaultHandDef()};
  hands[0].body = 0, hands[0].coupling.mode = H6_COUPLING_DIRECT;
  hands[1].body = 1;
  for (const h6CouplingMode other : {H6_COUPLING_DYNAMIC, H6_COUPLING_STATIC}) {
    hands[1].coupling.mode = other;
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = hands.data(), def.hand_count = 2;
    h6Error error;
    h6Session* s = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(s, error.message);
    std::array<h6DeviceSample, 2> samples{hand_at(pose(0, 0, 0)), hand_at(pose(0, 0, 26 * mm))};
    std::array<h6DeviceCommand, 2> felt{};
    for (int i = 0; i < 2000; ++i) {
      samples[0].pose.p.z = std::min(2.5 * mm, i * 0.005 * mm);
      h6Step(s, samples.data(), felt.data());
    }
    CHECK(h6GetBody(s, 0).pose.p.z == h6::test::near(2.5 * mm));
    CHECK(h6GetBody(s, 1).pose.p.z > 27 * mm);
    CHECK(felt[0].wrench.force.z < -0.5);
    // Action and reaction, at rest.
    CHECK(felt[0].wrench.force.z == h6::test::near(-felt[1].wrench.force.z).epsilon(1e-3));
    h6DestroySession(s);
  }
}

TEST_CASE("a quasi-static or direct body has no velocity after a teleport") {
  for (const h6CouplingMode mode : {H6_COUPLING_STATIC, H6_COUPLING_DIRECT}) {
    BoxOnFloor scene;
    scene.hand.coupling.mode = mode;
    scene.open();
    const h6BodyState there{pose(0, 0, 30 * mm), {{1, 2, 3}, {4, 5, 6}}};
    h6SetBody(scene.session, 1, &there);
    CHECK(scene.body().pose.p.z == h6::test::near(30 * mm));
    CHECK(norm(scene.body().velocity.linear) == 0);
    CHECK(norm(scene.body().velocity.angular) == 0);
  }
  BoxOnFloor scene;
  scene.bodies[1].translation_only = true;
  scene.open();
  const h6BodyState there{pose(0, 0, 30 * mm), {{1, 2, 3}, {4, 5, 6}}};
  h6SetBody(scene.session, 1, &there);
  CHECK(scene.body().velocity.linear.x == 1);
  CHECK(norm(scene.body().velocity.angular) == 0);
}

TEST_CASE("invalid coupling modes are refused with a sentence that names the value") {
  const auto complaint_of = [](const std::function<void(BoxOnFloor&)>& spoil) {
    BoxOnFloor scene;
    spoil(scene);
    h6Error error{};
    h6Session* session = h6CreateSession(scene.model.handle, &scene.def, &error);
    const std::string text = session ? "" : error.message;
    h6DestroySession(session);
    return text;
  };
  CHECK(complaint_of([](BoxOnFloor&) {}) == "");
  static std::array<h6HandDef, 2> two;
  const auto hands = [](BoxOnFloor& s, h6CouplingMode first, h6CouplingMode second) {
    two = {s.hand, s.hand};
    two[0].coupling.mode = first, two[1].coupling.mode = second;
    s.def.hands = two.data(), s.def.hand_count = 2;
  };
  CHECK(complaint_of([&](BoxOnFloor& s) { hands(s, H6_COUPLING_DYNAMIC, H6_COUPLING_DYNAMIC); }) ==
        "");
  const auto number = [](h6CouplingMode& mode, int value) {
    std::memcpy(&mode, &value, sizeof value);
  };
  const std::pair<std::function<void(BoxOnFloor&)>, const char*> bad[] = {
      {[&](BoxOnFloor& s) { number(s.hand.coupling.mode, 3); }, "coupling mode 3"},
      {[&](BoxOnFloor& s) { number(s.hand.coupling.mode, -1); }, "coupling mode -1"},
      {[](BoxOnFloor& s) { s.hand.coupling.max_step_voxels = 0; }, "max_step_voxels"},
      {[](BoxOnFloor& s) { s.hand.coupling.max_step_voxels = -1; }, "max_step_voxels"},
      {[](BoxOnFloor& s) { s.hand.coupling.max_step_voxels = NAN; }, "max_step_voxels"},
      {[](BoxOnFloor& s) { s.hand.coupling.max_step_voxels = HUGE_VAL; }, "max_step_voxels"},
      {[](BoxOnFloor& s) {
         s.hand.coupling.mode = H6_COUPLING_STATIC, s.hand.mode = H6_ADMITTANCE;
       },
       "dynamic"},
      {[](BoxOnFloor& s) {
         s.hand.coupling.mode = H6_COUPLING_DIRECT, s.hand.mode = H6_PSEUDO_ADMITTANCE;
       },
       "dynamic"},
      {[&](BoxOnFloor& s) { hands(s, H6_COUPLING_DIRECT, H6_COUPLING_DIRECT); }, "one hand"},
      {[&](BoxOnFloor& s) { hands(s, H6_COUPLING_DYNAMIC, H6_COUPLING_DIRECT); }, "one hand"},
      {[&](BoxOnFloor& s) { hands(s, H6_COUPLING_STATIC, H6_COUPLING_DYNAMIC); }, "one hand"},
  };
  for (const auto& [spoil, word] : bad) {
    const std::string text = complaint_of(spoil);
    CHECK_MESSAGE(text.find(word) != std::string::npos, word, " / ", text);
  }
}

TEST_CASE("dragged along a hollow from afar, a quasi-static body stays within half a voxel") {
  // A ball of 5 mm in a hollow of 15 mm. The hand jumps to the other side, far beyond saturation.
  // Nearly all of each step is along the wall, and the bounded step must still keep the body out of
  // the wall.
  FieldArrays hollow = sample_analytic(
      [](double x, double y, double z) { return 15 * mm - std::sqrt(x * x + y * y + z * z); },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  ShellArrays ball = sphere_points(5 * mm, 400);
  Model model({def_of(hollow)}, {ball.def()});
  for (const h6Method method : {H6_METHOD_GAUSS3, H6_METHOD_ROBUST, H6_METHOD_SERIES})
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
      std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
      bodies[0].fixed = true, bodies[0].field = 0;
      bodies[1].shell = 0;
      h6HandDef hand = h6DefaultHandDef();
      hand.body = 1, hand.coupling.mode = H6_COUPLING_STATIC;
      h6SessionDef def = h6DefaultSessionDef();
      def.contact.method = method;
      def.gradient = gradient;
      def.bodies = bodies.data(), def.body_count = 2;
      def.hands = &hand, def.hand_count = 1;
      h6Session* s = h6CreateSession(model.handle, &def, nullptr);
      REQUIRE(s);
      double at_rest = 0, dragged = 0;
      for (int i = 0; i < 600; ++i) {
        const double angle = i < 300 ? 0 : 2.6;
        const h6DeviceSample sample =
            hand_at(pose(200 * mm * std::cos(angle), 200 * mm * std::sin(angle), 0));
        h6Step(s, &sample, nullptr);
        (i < 300 ? at_rest : dragged) = std::max(i < 300 ? 0 : dragged, h6GetFrame(s).max_depth);
      }
      CAPTURE(h6MethodName(method));
      CHECK(at_rest > 0.1 * mm);
      CHECK(dragged < 0.5 * mm);
      CHECK(h6GetBody(s, 1).pose.p.x < -7 * mm);  // it reached the other side
      h6DestroySession(s);
    }
}
