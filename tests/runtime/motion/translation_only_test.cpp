// SPDX-License-Identifier: Apache-2.0
// Bodies of three degrees of freedom: they never turn and feel no torque.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"
#include "tests/support/box_on_floor.h"
#include "tests/support/near.h"
#include "tests/support/reports.h"

using namespace h6::test;

TEST_CASE("a body of translations alone keeps its orientation to the bit and gives no torque") {
  struct Way {
    h6CouplingMode mode;
    h6Integrator integrator;
    h6Gradient gradient;
  };
  const h6Quat start = about(0, 0.6, 0.8, 0.01);
  for (const Way& way : {Way{H6_COUPLING_DYNAMIC, H6_IMPLICIT, H6_SYMMETRIC},
                         Way{H6_COUPLING_DYNAMIC, H6_IMPLICIT, H6_EXACT},
                         Way{H6_COUPLING_DYNAMIC, H6_EXPLICIT, H6_SYMMETRIC},
                         Way{H6_COUPLING_STATIC, H6_IMPLICIT, H6_SYMMETRIC},
                         Way{H6_COUPLING_STATIC, H6_IMPLICIT, H6_EXACT},
                         Way{H6_COUPLING_DIRECT, H6_IMPLICIT, H6_SYMMETRIC}}) {
    BoxOnFloor scene;
    scene.bodies[1].translation_only = true;
    scene.bodies[1].pose.q = start;
    scene.bodies[1].velocity.angular = {1, 2, 3};
    scene.hand.coupling.mode = way.mode;
    scene.def.integrator = way.integrator;
    scene.def.gradient = way.gradient;
    // With substeps a direct body stays behind so fast a hand.
    if (way.mode == H6_COUPLING_DIRECT) scene.def.max_substeps = 1;
    if (way.integrator == H6_EXPLICIT) scene.hand.coupling.damping_ratio = 0.1;
    scene.open();
    const h6Quat q = scene.body().pose.q;
    std::uint32_t touched = 0;
    h6DeviceSample last{};
    for (int i = 0; i < 600; ++i) {
      h6DeviceSample sample = wild(i);
      sample.pose.p.z = 3 * mm;  // off-centre contacts would turn it
      const h6DeviceCommand felt = scene.hold(sample, 1);
      touched += h6GetFrame(scene.session).contacts;
      last = sample;
      CHECK(norm(felt.wrench.torque) == 0);
      CHECK(same_bits(scene.body().pose.q, q));
      CHECK(norm(scene.body().velocity.angular) == 0);
      CHECK((h6GetFrame(scene.session).status & (H6_SOLVE_FAILED | H6_STATE_NOT_FINITE)) == 0);
      // The wrist turns, but the body's mesh frame does not turn with it.
      if (way.mode == H6_COUPLING_DIRECT) CHECK(norm(scene.body().pose.p - sample.pose.p) < 1e-15);
    }
    CHECK(touched > 0);
    // The hand was too fast on the way, so the safety chain cut its force to zero.
    CHECK(h6::test::safety_of(scene.session, 0).fault == H6_CAUSE_OVERSPEED);
    last.velocity = {};
    scene.hold(last, 100);
    h6Arm(scene.session);
    CHECK(norm(scene.hold(last, 5).wrench.force) > 0.1);
  }
}

TEST_CASE("without torques a body of translations alone moves as one of six degrees does") {
  for (const h6CouplingMode mode : {H6_COUPLING_DYNAMIC, H6_COUPLING_STATIC})
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
      const auto heights = [&](bool translation_only) {
        BoxOnFloor scene;
        scene.bodies[1].translation_only = translation_only;
        scene.hand.coupling.mode = mode;
        scene.def.gradient = gradient;
        scene.open();
        std::vector<h6Vec3> path;
        for (int i = 0; i < 500; ++i) {
          // Along the middle of the box, where the floor pushes through the centre of mass.
          scene.hold(pose(0, 0, (5 - 3 * std::sin(0.01 * i)) * mm), 1);
          path.push_back(scene.body().pose.p);
        }
        return path;
      };
      const std::vector<h6Vec3> three = heights(true), six = heights(false);
      double worst = 0, lowest = 1;
      for (std::size_t i = 0; i < three.size(); ++i) {
        worst = std::max(worst, norm(three[i] - six[i]));
        lowest = std::min(lowest, three[i].z);
      }
      CHECK(lowest < 4.95 * mm);  // it touched
      CHECK(worst < 1e-8);
    }
}

TEST_CASE("centre of mass and inertia do not matter to a body of translations alone") {
  struct Way {
    h6CouplingMode mode;
    h6Integrator integrator;
    h6Gradient gradient;
  };
  for (const Way& way : {Way{H6_COUPLING_DYNAMIC, H6_IMPLICIT, H6_SYMMETRIC},
                         Way{H6_COUPLING_DYNAMIC, H6_IMPLICIT, H6_EXACT},
                         Way{H6_COUPLING_STATIC, H6_IMPLICIT, H6_SYMMETRIC},
                         Way{H6_COUPLING_STATIC, H6_IMPLICIT, H6_EXACT}}) {
    // Tilted: only one edge touches, so there are torques, and they differ.
    const auto path_with = [&](const h6Vec3& com, double inertia) {
      BoxOnFloor scene;
      scene.def.contact.method = H6_METHOD_GAUSS3;
      scene.def.integrator = way.integrator;
      scene.def.gradient = way.gradient;
      scene.hand.coupling.mode = way.mode;
      scene.bodies[1].translation_only = true;
      scene.bodies[1].pose.q = about(0, 1, 0, 0.1);
      scene.bodies[1].com = com;
      for (int i = 0; i < 3; ++i) scene.bodies[1].inertia[i] = inertia;
      scene.open();
      std::vector<h6Vec3> path;
      std::uint32_t touched = 0;
      for (int i = 0; i < 400; ++i) {
        scene.hold(pose(2 * mm * std::sin(0.02 * i), 0, (6 - 2 * std::sin(0.01 * i)) * mm), 1);
        path.push_back(scene.body().pose.p);
        touched += h6GetFrame(scene.session).contacts;
      }
      CHECK(touched > 100);
      return path;
    };
    const std::vector<h6Vec3> here = path_with({0, 0, 0}, 1e-5),
                              there = path_with({8 * mm, -5 * mm, 3 * mm}, 3e-6);
    for (std::size_t i = 0; i < here.size(); ++i) CHECK(norm(here[i] - there[i]) < 1e-9);
  }
}

TEST_CASE(
    "two bodies in one solve, one of translations alone: it does not turn, momentum is kept") {
  FieldArrays ball = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 10 * mm; },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  ShellArrays box = bottom_face(10 * mm, 10 * mm, 5 * mm, 20, 20);
  for (const h6Method method : {H6_METHOD_ROBUST, H6_METHOD_SERIES})
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
      Model model({def_of(ball)}, {box.def()});
      std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
      bodies[0].field = 0, bodies[0].mass = 0.2;
      bodies[0].inertia[0] = bodies[0].inertia[1] = bodies[0].inertia[2] = 8e-6;
      bodies[1].shell = 0, bodies[1].translation_only = true;
      bodies[1].pose = pose(4 * mm, 2 * mm, 15.5 * mm);
      bodies[1].velocity.linear = {0, 0.02, -0.2};
      h6SessionDef def = h6DefaultSessionDef();
      def.contact.method = method;
      def.gradient = gradient;
      def.bodies = bodies.data(), def.body_count = 2;
      h6Session* s = h6CreateSession(model.handle, &def, nullptr);
      REQUIRE(s);
      const h6Quat q = h6GetBody(s, 1).pose.q;
      double worst = 0;
      for (int i = 0; i < 200; ++i) {
        h6Step(s, nullptr, nullptr);
        const h6Vec3 a = h6GetBody(s, 0).velocity.linear, b = h6GetBody(s, 1).velocity.linear;
        worst = std::max({worst, std::fabs(0.2 * a.x + 0.1 * b.x),
                          std::fabs(0.2 * a.y + 0.1 * b.y - 0.1 * 0.02),
                          std::fabs(0.2 * a.z + 0.1 * b.z + 0.1 * 0.2)});
      }
      CHECK(h6GetBody(s, 0).velocity.linear.z < -0.01);
      CHECK(same_bits(h6GetBody(s, 1).pose.q, q));
      CHECK(worst < 1e-8);
      h6DestroySession(s);
    }
}

TEST_CASE("a body of translations alone needs no inertia") {
  FieldArrays ball = sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 10 * mm; },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  Model model({def_of(ball)}, {});
  h6BodyDef body = h6DefaultBodyDef();
  body.field = 0, body.translation_only = true;
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = &body, def.body_count = 1;
  def.hands = &hand, def.hand_count = 1;
  h6Session* s = h6CreateSession(model.handle, &def, nullptr);
  REQUIRE(s);
  const h6DeviceSample sample = hand_at({{10 * mm, 0, 0}, about(1, 0, 0, 1)});
  for (int i = 0; i < 4000; ++i) h6Step(s, &sample, nullptr);
  CHECK(h6GetBody(s, 0).pose.p.x == h6::test::near(10 * mm).epsilon(1e-6));
  CHECK(h6GetBody(s, 0).pose.q.w == 1);
  h6DestroySession(s);
}
