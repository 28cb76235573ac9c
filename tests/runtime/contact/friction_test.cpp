// SPDX-License-Identifier: Apache-2.0
// friction_test.cpp - Coulomb friction with stiction: what holds, what slides, and with what force.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/frame/session.h"
#include "tests/support/box_on_slope.h"

using namespace h6;
using namespace h6::test;

namespace {

constexpr h6Method kMethods[] = {H6_METHOD_NONE,   H6_METHOD_GLOBAL, H6_METHOD_CLUSTER,
                                 H6_METHOD_GAUSS3, H6_METHOD_GAUSS6, H6_METHOD_ROBUST,
                                 H6_METHOD_SERIES, H6_METHOD_FIRM};

// The sum of all loads, each times `lever` of its arm in the floor's plane [N] or [N m].
template <class Lever>
double load_of(const h6Session* session, const h6ContactDef& def, const Lever& lever) {
  const h6Contacts c = h6GetContacts(session, 1);
  double sum = 0;
  for (std::size_t i = 0; i < c.count; ++i) sum += c.load[i] * lever(c.rx[i], c.ry[i]);
  return (def.stiffness > 0 ? def.stiffness : 1e4) * sum;  // the default of light parts
}

// A hand on a box: it presses 3 mm into the floor and trembles.
h6DeviceSample trembling(double t, double x, double amplitude) {
  const auto wave = [t](double rate, double phase) {
    return std::sin(2 * M_PI * rate * t + phase);
  };
  const double a = 0.1 * mm * amplitude;
  return hand_at({{x + a * wave(9, 0), a * wave(7.3, 1), 2 * mm + 3 * a * wave(8.1, 2)},
                  about(0.6, 0.64, 0.48, 0.01 * amplitude * wave(6.7, 0.3))});
}

}  // namespace

TEST_CASE("a box on a slope below the friction angle stays where it is") {
  for (const h6Method method : kMethods)
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
      CAPTURE(std::string(h6MethodName(method)));
      CAPTURE(int{gradient});
      BoxOnSlope box(0.5, 0.95 * std::atan(0.5));
      box.def.contact.method = method;
      box.def.gradient = gradient;
      box.open();
      box.run(1);
      const h6BodyState begin = box.body();
      box.run(method == H6_METHOD_FIRM && gradient == H6_SYMMETRIC ? 60 : 3);
      CHECK(norm(box.body().pose.p - begin.pose.p) < 1e-9);
      CHECK(angle_between(box.body().pose.q, begin.pose.q) < 1e-6);
    }
}

TEST_CASE("a box on a steeper slope slides with g (sin a - mu cos a)") {
  for (const h6Method method : kMethods)
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
      CAPTURE(std::string(h6MethodName(method)));
      CAPTURE(int{gradient});
      const double slope = 0.5, mu = 0.3;
      BoxOnSlope box(mu, slope);
      box.def.contact.method = method;
      box.def.gradient = gradient;
      box.bodies[1].pose.p.x = -40 * mm;
      box.open();
      box.run(0.1);
      const double v = box.body().velocity.linear.x;
      box.run(0.1);
      const double a = (box.body().velocity.linear.x - v) / 0.1;
      CHECK(a ==
            doctest::Approx(g * (std::sin(slope) - mu * std::cos(slope))).epsilon(0.02).scale(0));
    }
}

TEST_CASE("a slope within two percent of the friction angle decides between rest and motion") {
  const double mu = 0.4;
  BoxOnSlope box(mu, std::atan(0.98 * mu));
  box.open();
  box.run(1);
  const double x = box.body().pose.p.x;
  box.run(2);
  CHECK(std::fabs(box.body().pose.p.x - x) < 1e-9);
  BoxOnSlope steep(mu, std::atan(1.02 * mu));
  steep.open();
  steep.run(1);
  CHECK(steep.body().velocity.linear.x > 0.01);
}

TEST_CASE("friction acts on both bodies and keeps their momentum") {
  // Two free bodies without gravity: a box flies onto a slab.
  BoxOnFloor scene;
  scene.bodies[0].fixed = false, scene.bodies[0].mass = 0.3;
  const double own[6] = {4e-5, 4e-5, 6e-5, 0, 0, 0};
  std::copy(own, own + 6, scene.bodies[0].inertia);
  scene.bodies[1].pose.p.x = 4 * mm;
  scene.bodies[1].velocity.linear = {0.2, 0.1, -0.3};
  scene.bodies[1].velocity.angular = {0, 0, 20};
  scene.def.hands = nullptr, scene.def.hand_count = 0;
  scene.def.contact.friction = 0.6;
  for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
    scene.def.gradient = gradient;
    scene.open();
    const auto momentum = [&] {
      const h6BodyState a = scene.body(), b = h6GetBody(scene.session, 0);
      return 0.1 * a.velocity.linear + 0.3 * b.velocity.linear;
    };
    // About the origin.
    const auto spin = [&] {
      Vec3 sum = Vec3::Zero();
      for (const Body& b : scene.session->bodies)
        sum += b.mass * b.x.cross(b.v) + b.R * b.inertia * b.R.transpose() * b.w;
      return sum;
    };
    const h6Vec3 begin = momentum();
    const Vec3 spin_begin = spin();
    double most = 0;
    for (int i = 0; i < 60; ++i) {
      h6Step(scene.session, nullptr, nullptr);
      most = std::max(most, scene.session->frictions[0].f.head<3>().norm());
      CHECK(norm(momentum() - begin) < 1e-12);
    }
    CHECK(most > 0.5);
    CHECK(h6GetBody(scene.session, 0).velocity.linear.x > 0.005);
    CHECK(h6GetBody(scene.session, 0).velocity.angular.z > 0.1);
    CHECK((spin() - spin_begin).norm() < 0.005 * spin_begin.norm());
  }
}

TEST_CASE("a spinning disc is braked by mu times the sum of loads times their arms") {
  for (const h6Method method : kMethods) {
    CAPTURE(std::string(h6MethodName(method)));
    BoxOnSlope box(0.3, 0);
    box.shell = ShellArrays();
    for (int i = 0; i < 400; ++i) {
      const double r = 10 * mm * std::sqrt((i + 0.5) / 400), a = 2.39996323 * i;
      box.shell.add(r * std::cos(a), r * std::sin(a), -5 * mm, 0, 0, 1);
    }
    const Model model({def_of(box.field)}, {box.shell.def()});
    box.def.contact.method = method;
    box.session = h6CreateSession(model.handle, &box.def, nullptr);
    REQUIRE(box.session);
    box.run(1);
    h6BodyState spinning = box.body();
    spinning.velocity.angular.z = 50;
    h6SetBody(box.session, 1, &spinning);
    box.run(0.008);
    const double before = box.body().velocity.angular.z;
    double torque = 0;
    for (int i = 0; i < 10; ++i) {
      box.run(0.001);
      torque += 0.1 * 0.3 * load_of(box.session, box.def.contact, [](double x, double y) {
                  return std::hypot(x, y);
                });
    }
    const double braked = (before - box.body().velocity.angular.z) / 0.01;
    CHECK(braked * box.bodies[1].inertia[2] == doctest::Approx(torque).epsilon(0.01).scale(0));
    CHECK(torque == doctest::Approx(0.3 * 0.1 * g * 10 * mm * 2 / 3).epsilon(0.05).scale(0));
    h6DestroySession(box.session);
    box.session = nullptr;
  }
}

TEST_CASE("a hand that turns a pressed box slowly feels the whole torsional friction") {
  for (const h6CouplingMode mode : {H6_COUPLING_DYNAMIC, H6_COUPLING_STATIC, H6_COUPLING_DIRECT}) {
    CAPTURE(int{mode});
    BoxOnFloor box;
    box.def.contact.friction = 0.3;
    box.def.contact.method = H6_METHOD_GAUSS3;  // the same load on every point
    box.hand.coupling.mode = mode;
    box.open();
    const double depth = mode == H6_COUPLING_DIRECT ? 0.3 * mm : 3 * mm;
    const auto turn = [&](int i) {
      h6DeviceSample s = hand_at({{0, 0, 5 * mm - depth}, about(0, 0, 1, 2e-4 * i)});
      s.velocity.angular.z = 0.2;
      return box.hold(s, 1).wrench.torque.z;
    };
    for (int i = 0; i < 2000; ++i) turn(i);
    double felt = 0;
    for (int i = 2000; i < 2500; ++i) felt -= turn(i) / 500;
    const double right = 0.3 * load_of(box.session, box.def.contact,
                                       [](double x, double y) { return std::hypot(x, y); });
    CHECK(felt == doctest::Approx(right).epsilon(0.02).scale(0));
  }
}

TEST_CASE("a dragged box sticks until the pull exceeds mu N, and sticks again on the way back") {
  for (const h6CouplingMode mode : {H6_COUPLING_DYNAMIC, H6_COUPLING_STATIC}) {
    CAPTURE(int{mode});
    BoxOnFloor box;
    box.def.contact.friction = 0.3;
    box.hand.coupling.mode = mode;
    box.open();
    box.hold(pose(0, 0, 2 * mm), 500);
    const double most =
        0.3 * load_of(box.session, box.def.contact, [](double, double) { return 1.0; });
    // Where the hand is, what it pulls, where the box is: there and back again by 4 mm.
    double x = 0, x_most = 0, pull_most = 0, back = 0;
    for (int i = 0; i < 4000; ++i) {
      x += (i < 2000 ? 2 : -2) * 1e-3 * mm;
      const double pull = -box.hold(pose(x, 0, 2 * mm), 1).wrench.force.x;
      const double at = box.body().pose.p.x;
      // Presliding: the spring has k, and yields at mu N.
      if (pull < 0.9 * most && i < 2000)
        CHECK(at < 1.07 * (pull / 1e4 + 1e-6));  // the box tilts a little
      x_most = std::max(x_most, at), pull_most = std::max(pull_most, pull);
      if (i > 2000 && pull > -0.9 * most) back = at;
    }
    CHECK(pull_most == doctest::Approx(most).epsilon(0.02).scale(0));
    CHECK(x_most == doctest::Approx(4 * mm - most / 1e3).epsilon(0.02).scale(0));
    // While the pull turns from mu N to -0.9 mu N the box gives way by no more than the spring.
    CHECK(x_most - back < 2.05 * most / 1e4);
    CHECK(box.body().pose.p.x == doctest::Approx(most / 1e3).epsilon(0.06).scale(0));
  }
}

TEST_CASE("a held part does not creep under a trembling hand") {
  for (const h6Method method : {H6_METHOD_ROBUST, H6_METHOD_SERIES, H6_METHOD_FIRM})
    for (const h6CouplingMode mode : {H6_COUPLING_DYNAMIC, H6_COUPLING_STATIC}) {
      CAPTURE(std::string(h6MethodName(method)));
      CAPTURE(int{mode});
      BoxOnFloor box;
      box.def.contact.method = method;
      box.def.contact.friction = 0.5;
      box.hand.coupling.mode = mode;
      box.open();
      box.hold(trembling(0, 0, 0), 500);
      // The hand pulls sideways by 0.4 mm and trembles by 0.3 mm and half a degree.
      const auto mean = [&](int second) {
        h6Vec3 sum{};
        for (int i = 0; i < 1000; ++i) {
          box.hold(trembling(second + 1e-3 * i, 0.4 * mm, 1), 1);
          sum = sum + 1e-3 * box.body().pose.p;
        }
        return sum;
      };
      mean(0);
      const h6Vec3 begin = mean(1);
      for (int second = 2; second < 20; ++second) mean(second);
      const h6Vec3 end = mean(20);
      CHECK(std::hypot(end.x - begin.x, end.y - begin.y) < 3e-6);
      CHECK(begin.x < 50e-6);
    }
}

TEST_CASE("closed cycles of a hand never get work out of friction, however its load varies") {
  // Direct coupling: the hand moves the box exactly; between frames the force is taken as linear.
  for (const h6Method method : kMethods) {
    CAPTURE(std::string(h6MethodName(method)));
    for (int phase = 0; phase < 8; ++phase)
      for (const double amplitude : {0.01 * mm, 0.05 * mm, 1 * mm}) {
        CAPTURE(phase);
        CAPTURE(amplitude);
        BoxOnFloor box;
        box.def.contact.method = method;
        box.def.contact.friction = 0.5;
        box.def.contact.damping = 0;
        box.hand.coupling.mode = H6_COUPLING_DIRECT;
        box.open();
        const auto at = [&](int i) {
          const double a = 2 * M_PI * i / 200;
          // The load shifts from side to side while the spring is stretched and twisted.
          const double tilt = 0.006 * std::sin(a + phase * M_PI / 4);
          const double turn = amplitude / (8 * mm) * std::sin(a);
          const Quat q = exp_rotation({0, tilt, 0}) * exp_rotation({0, 0, turn});
          return h6Pose{{amplitude * std::sin(a + 1), 0.5 * amplitude * std::cos(a),
                         5 * mm - (0.15 + 0.05 * std::sin(a + phase)) * mm},
                        to(q)};
        };
        box.hold(at(0), 2);
        double given = 0, lost = 0;  // by the friction; within a cycle
        for (int i = 0; i < 600; ++i) {
          const Vec6 f = box.session->frictions[0].f;
          const h6Pose p = at(i), q = at(i + 1);
          const auto com = [](const h6Pose& s) { return from(place(s, {0, 0, 1 * mm})); };
          const Vec3 turned = log_rotation(from(q.q) * from(p.q).conjugate());
          box.hold(q, 1);
          const Vec6 mean = 0.5 * (f + box.session->frictions[0].f);
          const double work =
              mean.head<3>().dot(Vec3(com(q) - com(p))) + mean.tail<3>().dot(turned);
          given += work, lost -= std::min(work, 0.0);
        }
        CHECK(lost > 0);
        CHECK(given < 1e-4 * lost);
      }
  }
}

namespace {

// A box 0.2 mm too large on both sides, between two plates.
struct BoxBetweenPlates {
  FieldArrays plates[2];
  ShellArrays shell = bottom_face(10 * mm, 10 * mm, 5 * mm, 8, 8);
  std::array<h6BodyDef, 3> bodies{h6DefaultBodyDef(), h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6SessionDef def = h6DefaultSessionDef();

  BoxBetweenPlates() {
    for (int b = 0; b < 2; ++b)
      plates[b] = sample_analytic([b](double, double, double z) { return 4.8 * mm + (b ? -z : z); },
                                  {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
    for (int i = 0; i < 64; ++i) shell.add(shell.x[i], shell.y[i], 5 * mm, 0, 0, -1);
    for (int b = 0; b < 2; ++b) bodies[b].fixed = true, bodies[b].field = b;
    bodies[2].shell = 0;
    def.bodies = bodies.data(), def.body_count = 3;
    def.contact.fit = H6_FIT_TIGHT;
    def.contact.friction = 1;
  }
  template <class Visit>
  void run(int frames, const Visit& visit) {
    const Model model({def_of(plates[0]), def_of(plates[1])}, {shell.def()});
    h6Session* session = h6CreateSession(model.handle, &def, nullptr);
    REQUIRE(session);
    for (int i = 0; i < frames; ++i) {
      h6Step(session, nullptr, nullptr);
      visit(i, session);
    }
    h6DestroySession(session);
  }
};

}  // namespace

TEST_CASE("two plates hold a box between them by the friction of both") {
  for (const h6Method method : kMethods) {
    CAPTURE(std::string(h6MethodName(method)));
    BoxBetweenPlates box;
    box.def.contact.method = method;
    box.def.gravity = {g, 0, 0};
    double load = 0;  // both plates together
    box.run(300, [&](int i, h6Session* session) {
      const h6Contacts c = h6GetContacts(session, 2);
      for (std::size_t k = 0; i == 299 && k < c.count; ++k) load += 1e4 * c.load[k];
    });
    // Friction carries twice the weight: the box stays.
    h6BodyState begin{};
    box.def.contact.friction = 2 * 0.1 * g / load;
    box.run(400, [&](int i, h6Session* session) {
      const h6BodyState now = h6GetBody(session, 2);
      if (i == 299) begin = now;
      if (i == 399) CHECK(norm(now.pose.p - begin.pose.p) < 1e-8);
    });
    // Half of the weight: it falls with half of g.
    box.def.contact.friction /= 4;
    box.run(60, [&](int i, h6Session* session) {
      const h6BodyState now = h6GetBody(session, 2);
      if (i == 19) begin = now;
      if (i == 59)
        CHECK((now.velocity.linear.x - begin.velocity.linear.x) / 0.04 ==
              doctest::Approx(0.5 * g).epsilon(0.03).scale(0));
    });
  }
}

TEST_CASE("a shove between two plates dies out and never grows, without any damping") {
  for (const h6Method method : kMethods)
    for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
      CAPTURE(std::string(h6MethodName(method)));
      CAPTURE(int{gradient});
      BoxBetweenPlates box;
      box.def.contact.method = method;
      box.def.contact.damping = 0;
      box.def.gradient = gradient;
      box.bodies[2].velocity = {{0.3, 0.1, 0}, {0, 0, 15}};
      std::fill_n(box.bodies[2].inertia, 3, 1e-5);
      const auto energy = [](const h6Velocity& u) {
        return 0.05 * dot(u.linear, u.linear) + 0.5e-5 * dot(u.angular, u.angular);
      };
      const double begin = energy(box.bodies[2].velocity);
      double most = 0, end = 0;
      box.run(3000, [&](int, h6Session* session) {
        end = energy(h6GetBody(session, 2).velocity);
        most = std::max(most, end);
      });
      CHECK(most < begin);
      CHECK(end < 1e-6 * begin);
    }
}

TEST_CASE("an obstacle that a program moves drags a box along, as fast as friction can") {
  for (const double a : {0.2 * g, 0.6 * g}) {
    CAPTURE(a);
    BoxOnSlope box(0.4, 0);
    box.open();
    box.run(0.5);
    for (int i = 1; i <= 50; ++i) {
      const double t = 1e-3 * i;
      h6BodyState floor{pose(0.5 * a * t * t, 0, 0), {{a * t, 0, 0}, {0, 0, 0}}};
      h6SetBody(box.session, 0, &floor);
      h6Step(box.session, nullptr, nullptr);
    }
    const double right = 0.05 * std::min(a, 0.4 * g);
    // It takes a few frames to stretch the spring.
    CHECK(box.body().velocity.linear.x == doctest::Approx(right).epsilon(0.1).scale(0));
  }
}

TEST_CASE("fast sliding is braked by mu times the load, in frames of one step and of many") {
  for (const std::uint32_t substeps : {1u, 16u})
    for (const h6Method method : {H6_METHOD_ROBUST, H6_METHOD_FIRM}) {
      CAPTURE(substeps);
      CAPTURE(std::string(h6MethodName(method)));
      BoxOnSlope box(0.4, 0);
      box.def.contact.method = method;
      box.def.max_substeps = substeps;
      box.bodies[1].pose.p.x = -50 * mm;
      box.bodies[1].com.z = -4.5 * mm;  // the brake does not tilt the box
      box.open();
      box.run(0.5);
      h6BodyState fast = box.body();
      fast.velocity.linear.x = 1.2;
      h6SetBody(box.session, 1, &fast);
      box.run(0.005);
      const double before = box.body().velocity.linear.x;
      double load = 0;
      for (int i = 0; i < 50; ++i) {
        box.run(0.001);
        load += load_of(box.session, box.def.contact, [](double, double) { return 1.0; }) / 50;
      }
      const double braked = (before - box.body().velocity.linear.x) / 0.05;
      CHECK(0.1 * braked == doctest::Approx(0.4 * load).epsilon(0.02).scale(0));
      CHECK(0.1 * braked == doctest::Approx(0.4 * 0.1 * g).epsilon(0.03).scale(0));
      if (substeps > 1) CHECK(h6GetFrame(box.session).substeps > 4);
    }
}

TEST_CASE("an explicit step holds a box on a slope, too") {
  BoxOnSlope box(0.5, 0.8 * std::atan(0.5));
  box.def.contact.method = H6_METHOD_GLOBAL;
  box.def.contact.global_n0 = 1;
  box.def.integrator = H6_EXPLICIT;
  box.open();
  box.run(2);
  const h6BodyState begin = box.body();
  box.run(5);
  CHECK(norm(box.body().pose.p - begin.pose.p) < 1e-7);
}

TEST_CASE("a ball rolls down a slope without slipping") {
  BoxOnSlope ball(0.3, 0.2);
  ball.shell = sphere_points(10 * mm, 20000);
  const Model model({def_of(ball.field)}, {ball.shell.def()});
  const double inertia = 0.4 * 0.1 * 1e-4;
  ball.bodies[1].com = {0, 0, 0};
  std::fill_n(ball.bodies[1].inertia, 3, inertia);
  ball.bodies[1].pose = pose(-40 * mm, 0, 10 * mm);
  ball.def.contact.damping = 0;  // of contacts that come in ahead of the ball: it brakes rolling
  ball.session = h6CreateSession(model.handle, &ball.def, nullptr);
  REQUIRE(ball.session);
  ball.run(0.1);
  const double before = ball.body().velocity.linear.x;
  ball.run(0.1);
  const h6BodyState now = ball.body();
  CHECK((now.velocity.linear.x - before) / 0.1 ==
        doctest::Approx(5.0 / 7 * g * std::sin(0.2)).epsilon(0.05).scale(0));
  CHECK(now.velocity.angular.y * 10 * mm ==
        doctest::Approx(now.velocity.linear.x).epsilon(0.01).scale(0));
  h6DestroySession(ball.session);
  ball.session = nullptr;
}

namespace {

// A box under firm, without friction by the setting, on a level floor. Its normals lean by `angle`
// off the vertical, all to the same side, so its pushes do.
struct LeaningBox : BoxOnSlope {
  std::optional<Model> leaning;
  explicit LeaningBox(double angle, double friction = 0) : BoxOnSlope(friction, 0) {
    for (std::size_t i = 0; i < shell.x.size(); ++i)
      shell.nx[i] = float(std::sin(angle)), shell.nz[i] = float(std::cos(angle));
    leaning.emplace(std::vector{def_of(field)}, std::vector{shell.def()});
    std::swap(model.handle, leaning->handle);
    def.contact.method = H6_METHOD_FIRM;
    bodies[1].translation_only = true;
    open();
  }
  const FrictionSpring& spring() const { return session->frictions[0]; }
};

}  // namespace

TEST_CASE("firm: pushes that lean do not drive a box along a level floor") {
  for (const double angle : {0.3, 0.6, 1.0}) {
    CAPTURE(angle);
    LeaningBox box(angle);
    box.run(1);
    // Along the push alone the floor would drive it by 0.07 to 0.2 g.
    const h6Contacts c = h6GetContacts(box.session, 1);
    CHECK(c.nx[0] > 0.07 * c.nz[0]);
    CHECK(norm(box.body().velocity.linear) < 1e-3);
    CHECK(box.spring().f.head<3>().norm() == doctest::Approx(0.1 * g * c.nx[0]).epsilon(0.05));
  }
}

TEST_CASE("firm: against the lean and across it nothing rubs") {
  LeaningBox box(0.6);
  box.run(0.5);
  h6BodyState moving = box.body();
  moving.velocity.linear = {-0.05, 0.05, 0};
  h6SetBody(box.session, 1, &moving);
  box.run(0.02);
  const h6Contacts c = h6GetContacts(box.session, 1);
  const h6Vec3 v = box.body().velocity.linear;
  CHECK(v.y == doctest::Approx(0.05).epsilon(0.01));
  // The push alone brakes it; friction would brake it as much again.
  CHECK(v.x + 0.05 == doctest::Approx(0.02 * g * c.nx[0] / c.nz[0]).epsilon(0.15));
}

TEST_CASE("firm: friction by the setting comes on top of that by the lean") {
  LeaningBox box(0.6, 0.05);
  box.run(1);
  CHECK(norm(box.body().velocity.linear) < 1e-3);
  const h6Vec3 before = box.body().pose.p;
  box.run(1);
  CHECK(norm(box.body().pose.p - before) < 1e-3 * mm);
}

TEST_CASE("firm: where no push leans nothing rubs") {
  LeaningBox box(0);
  box.run(0.5);
  CHECK(h6GetContacts(box.session, 1).count > 0);
  CHECK_FALSE(box.spring().holds);
  // A frictionless floor does not brake.
  h6BodyState moving = box.body();
  moving.velocity.linear.x = 0.02;
  h6SetBody(box.session, 1, &moving);
  box.run(0.5);
  CHECK(box.body().velocity.linear.x == doctest::Approx(0.02));
}
