// SPDX-License-Identifier: Apache-2.0
// How a body that is pushed against a field must move by physics.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/support/box_on_floor.h"

using namespace h6::test;

namespace {

// Its centre of mass is the mesh's origin.
struct CentredBox : BoxOnFloor {
  CentredBox() { bodies[1].com = {0, 0, 0}; }
};

}  // namespace

TEST_CASE("a box held into the floor comes to rest, with every method") {
  for (int method = 0; method < H6_METHOD_COUNT; ++method) {
    CentredBox scene;
    scene.def.contact.method = static_cast<h6Method>(method);
    scene.open();
    CAPTURE(h6MethodName(scene.def.contact.method));
    const h6DeviceCommand felt = scene.hold(pose(0, 0, 2 * mm), 2000);
    const h6BodyState state = h6GetBody(scene.session, 1);
    CHECK(std::fabs(state.velocity.linear.z) < 1e-6);
    CHECK(std::fabs(state.pose.q.w) == h6::test::near(1).epsilon(1e-6));
    const h6FrameReport frame = h6GetFrame(scene.session);
    CHECK(frame.contacts == 144);
    CHECK(frame.max_depth_voxels < 1.0);
    // At rest the hand feels the floor's force: k_VC times the lag of the body.
    CHECK(felt.wrench.force.z == h6::test::near(1e3 * (state.pose.p.z - 2 * mm)).epsilon(1e-3));
  }
}

TEST_CASE("penetration at rest is the coupling force over the net stiffness") {
  // A flat wall: 144 k for none, n0 k for global, k for gauss3.
  const std::array<std::pair<h6Method, double>, 3> nets = {
      {{H6_METHOD_NONE, 144.0}, {H6_METHOD_GLOBAL, 10.0}, {H6_METHOD_GAUSS3, 1.0}}};
  for (const auto& [method, net] : nets) {
    CentredBox scene;
    scene.def.contact.method = method;
    scene.open();
    CAPTURE(h6MethodName(method));
    scene.hold(pose(0, 0, 4 * mm), 4000);
    const double depth = h6GetFrame(scene.session).max_depth;
    // Springs in series: k_VC (1 mm - depth) = net k depth.
    CHECK(depth == h6::test::near(1e3 * mm / (1e3 + net * 1e4)).epsilon(0.02));
  }
}

TEST_CASE("the largest coupling force is k times half a voxel, however far the hand goes") {
  CentredBox scene;
  scene.def.contact.method = H6_METHOD_GAUSS3;
  scene.open();
  const h6DeviceCommand felt = scene.hold(pose(0, 0, -20 * mm), 4000);
  CHECK(h6GetCoupling(scene.session, 0).max_force == h6::test::near(5));
  CHECK(felt.wrench.force.z == h6::test::near(5).epsilon(1e-3));
  CHECK((h6GetFrame(scene.session).status & H6_COUPLING_SATURATED) != 0);
  CHECK(h6GetFrame(scene.session).max_depth_voxels == h6::test::near(0.5).epsilon(0.02));
}

TEST_CASE("saturation bounds spring and damper together, at any hand speed") {
  CentredBox scene;
  scene.open();
  h6DeviceSample sample = hand_at(pose(0, 0, 30 * mm));
  for (int i = 0; i < 200; ++i) {
    sample.pose.p.x = 0.02 * std::sin(0.9 * i);
    sample.velocity = {{3 * std::cos(7.0 * i), 2 * std::sin(3.0 * i), -1},
                       {20, -30 * std::sin(1.0 * i), 5}};
    h6DeviceCommand felt;
    h6Step(scene.session, &sample, &felt);
    const auto &f = felt.wrench.force, &t = felt.wrench.torque;
    CHECK(norm(f) <= 5 * (1 + 1e-9));
    CHECK(norm(t) <= h6GetCoupling(scene.session, 0).max_torque * (1 + 1e-9));
  }
}

TEST_CASE("a far hand pulls with the whole force, and the body arrives without overshoot") {
  for (const double way : {20.0, 100.0, 500.0}) {
    CAPTURE(way);
    CentredBox scene;
    scene.open();
    double pull = 0, highest = 0;
    for (int i = 0; i < 8000; ++i) {
      const h6DeviceCommand felt = scene.hold(pose(0, 0, way * mm), 1);
      pull = std::max(pull, norm(felt.wrench.force));
      highest = std::max(highest, h6GetBody(scene.session, 1).pose.p.z);
    }
    CHECK(pull == h6::test::near(5).epsilon(1e-9));
    CHECK(highest < (way + 0.02 * way) * mm);
    CHECK(h6GetBody(scene.session, 1).pose.p.z == h6::test::near(way * mm).epsilon(1e-6));
  }
}

TEST_CASE("without contact the body follows the hand to where it is") {
  CentredBox scene;
  scene.open();
  const h6Pose target{{5 * mm, -3 * mm, 40 * mm}, {std::cos(0.3), 0, std::sin(0.3), 0}};
  scene.hold(target, 6000);
  const h6Pose p = h6GetBody(scene.session, 1).pose;
  CHECK(p.p.x == h6::test::near(target.p.x).epsilon(1e-6));
  CHECK(p.p.z == h6::test::near(target.p.z).epsilon(1e-6));
  CHECK(p.q.y == h6::test::near(target.q.y).epsilon(1e-6));
}

TEST_CASE("the explicit step has the stability limit of the theory and the implicit one has none") {
  // Translation alone is stable below k_net = 4 m / h^2; with 144 unscaled contacts k_net = 144 k.
  // The box may also rock, which only lowers the limit: far below it is stable, far above it is
  // not.
  for (const auto& [k, integrator, stable] :
       {std::tuple{2e2, H6_EXPLICIT, true}, {2e4, H6_EXPLICIT, false}, {2e7, H6_IMPLICIT, true}}) {
    CentredBox scene;
    scene.def.contact.method = H6_METHOD_NONE;
    scene.def.contact.stiffness = k;
    scene.def.contact.damping = 0;
    scene.def.integrator = integrator;
    scene.def.max_substeps = 1;
    scene.hand.coupling.max_force = 5;
    scene.open();
    scene.hold(pose(0, 0, 4 * mm), 1500);
    double speed = 0;
    for (int i = 0; i < 500; ++i) {
      scene.hold(pose(0, 0, 4 * mm), 1);
      speed = std::max(speed, std::fabs(h6GetBody(scene.session, 1).velocity.linear.z));
    }
    CAPTURE(k);
    CHECK((speed < 0.01) == stable);
  }
}

TEST_CASE("two bodies that push each other keep their momentum") {
  // A free ball with a field, hit off-centre by a free box with a shell: nothing else acts.
  FieldArrays ball = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 10 * mm; },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  ShellArrays box = bottom_face(10 * mm, 10 * mm, 5 * mm, 20, 20);
  for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
    Model model({def_of(ball)}, {box.def()});
    std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].field = 0;
    bodies[0].mass = 0.2;
    const double I = 0.4 * 0.2 * 100 * mm * mm;
    bodies[0].inertia[0] = bodies[0].inertia[1] = bodies[0].inertia[2] = I;
    bodies[1].shell = 0;
    bodies[1].pose = pose(4 * mm, 2 * mm, 15.5 * mm);
    bodies[1].velocity.linear = {0, 0.02, -0.2};
    h6SessionDef def = h6DefaultSessionDef();
    def.gradient = gradient;
    def.bodies = bodies.data(), def.body_count = 2;
    h6Error error;
    h6Session* s = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(s, error.message);
    std::uint32_t touched = 0;
    double worst = 0;
    for (int i = 0; i < 200; ++i) {
      h6Step(s, nullptr, nullptr);
      touched += h6GetFrame(s).contacts;
      const h6Vec3 a = h6GetBody(s, 0).velocity.linear, b = h6GetBody(s, 1).velocity.linear;
      worst = std::max({worst, std::fabs(0.2 * a.x + 0.1 * b.x),
                        std::fabs(0.2 * a.y + 0.1 * b.y - 0.1 * 0.02),
                        std::fabs(0.2 * a.z + 0.1 * b.z + 0.1 * 0.2)});
    }
    CHECK(touched > 0);
    CHECK(h6GetBody(s, 0).velocity.linear.z < -0.01);  // the ball was hit
    CHECK(h6GetBody(s, 1).velocity.linear.z > -0.19);  // the box lost what the ball gained
    CHECK(worst < 1e-8);
    h6DestroySession(s);
  }
}

TEST_CASE("several fields act as one: two half floors hold like a whole one") {
  FieldArrays whole = CentredBox().field;
  const auto half = [](double sign) {
    return sample_analytic(
        [sign](double x, double, double z) {
          const double a = sign * x, b = z;  // the quarter space sign*x < 0, z < 0
          return a > 0 && b > 0 ? std::hypot(a, b) : std::max(a, b);
        },
        {-64 * mm, -64 * mm, -32 * mm}, mm, 16, 16, 8);
  };
  FieldArrays left = half(1), right = half(-1);
  ShellArrays shell = bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12);
  Model model({def_of(whole), def_of(left), def_of(right)}, {shell.def()});
  const auto rest_height = [&](std::vector<std::int32_t> fields) {
    std::vector<h6BodyDef> bodies(1 + fields.size(), h6DefaultBodyDef());
    bodies[0].shell = 0;
    bodies[0].pose = pose(0, 0, 5.2 * mm);
    for (std::size_t i = 0; i < fields.size(); ++i)
      bodies[i + 1].fixed = true, bodies[i + 1].field = fields[i];
    h6HandDef hand = h6DefaultHandDef();
    h6SessionDef def = h6DefaultSessionDef();
    def.contact.method = H6_METHOD_GAUSS3;
    def.bodies = bodies.data(), def.body_count = bodies.size();
    def.hands = &hand, def.hand_count = 1;
    h6Session* s = h6CreateSession(model.handle, &def, nullptr);
    REQUIRE(s);
    const h6DeviceSample sample = hand_at(pose(0, 0, 3 * mm));
    for (int i = 0; i < 3000; ++i) h6Step(s, &sample, nullptr);
    const double z = h6GetBody(s, 0).pose.p.z;
    CHECK(h6GetFrame(s).contacts == 144);
    h6DestroySession(s);
    return z;
  };
  // Depths, not heights. Interpolation rounds the edge where the halves meet: the twelve points
  // next to it are shallower by a sixth, which is 1.4 % of the mean depth; sums then differ by
  // about twice that.
  const double split = 5 * mm - rest_height({1, 2}), whole_depth = 5 * mm - rest_height({0});
  CHECK(split == h6::test::near(whole_depth).epsilon(0.04));
}

TEST_CASE("two hands hold two bodies, each its own") {
  CentredBox scene;
  std::array<h6BodyDef, 3> bodies{scene.bodies[0], scene.bodies[1], scene.bodies[1]};
  bodies[1].pose = pose(-20 * mm, 0, 5.2 * mm);
  bodies[2].pose = pose(20 * mm, 0, 5.2 * mm);
  std::array<h6HandDef, 2> hands{scene.hand, scene.hand};
  hands[1].body = 2;
  scene.def.bodies = bodies.data(), scene.def.body_count = 3;
  scene.def.hands = hands.data(), scene.def.hand_count = 2;
  scene.open();
  const std::array<h6DeviceSample, 2> samples{hand_at(pose(-20 * mm, 0, 4 * mm)),
                                              hand_at(pose(20 * mm, 0, 30 * mm))};
  std::array<h6DeviceCommand, 2> felt{};
  for (int i = 0; i < 3000; ++i) h6Step(scene.session, samples.data(), felt.data());
  CHECK(felt[0].wrench.force.z > 0.1);
  CHECK(std::fabs(felt[1].wrench.force.z) < 1e-6);
  CHECK(h6GetContacts(scene.session, 1).count == 144);
  CHECK(h6GetContacts(scene.session, 2).count == 0);
}

TEST_CASE("a scene moved and turned as a whole behaves the same") {
  const auto depth_at = [](const h6Quat& q) {
    CentredBox scene;
    const auto turn = [&](h6Vec3 v) {  // q v q*
      const double x = q.x, y = q.y, z = q.z, w = q.w;
      const double tx = 2 * (y * v.z - z * v.y), ty = 2 * (z * v.x - x * v.z),
                   tz = 2 * (x * v.y - y * v.x);
      return h6Vec3{v.x + w * tx + y * tz - z * ty + 1, v.y + w * ty + z * tx - x * tz - 2,
                    v.z + w * tz + x * ty - y * tx + 3};
    };
    scene.bodies[0].pose = {turn({0, 0, 0}), q};
    scene.bodies[1].pose = {turn({0, 0, 5.2 * mm}), q};
    scene.open();
    scene.hold(h6Pose{turn({0, 0, 3 * mm}), q}, 2000);
    return h6GetFrame(scene.session).max_depth;
  };
  const double straight = depth_at({1, 0, 0, 0});
  CHECK(straight > 1e-5);
  CHECK(depth_at({0.5, 0.5, -0.5, 0.5}) == h6::test::near(straight).epsilon(1e-3));
  CHECK(depth_at({0.8, 0, 0.6, 0}) == h6::test::near(straight).epsilon(1e-2));
}
