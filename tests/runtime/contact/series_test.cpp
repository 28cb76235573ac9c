// SPDX-License-Identifier: Apache-2.0
// `series` in whole frames: bounds, derivatives with several moving fields, the margin.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "hapsix/hapsix.h"
#include "kernels/weights/series_solve.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/weighing.h"
#include "runtime/frame/session.h"
#include "tests/support/analytic.h"
#include "tests/support/near.h"

using namespace h6;
using test::pose;

namespace {

constexpr double mm = 1e-3;

double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
}  // [-1, 1)
Vec3 vector(std::mt19937_64& random) { return {uniform(random), uniform(random), uniform(random)}; }

// A shell body (0) against planes on two moving bodies (1, 2), all in double.
struct World {
  std::vector<Vec3> point, normal;  // relative to body 0
  std::vector<int> field;           // of each point: 1 or 2
  Vec3 plane_normal[3], plane_point[3];
  double k = 1e4, beta = 1e-3, c = 4, lever = 0.02;

  struct State {
    std::array<Vec3, 3> x{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
    std::array<Quat, 3> q{Quat::Identity(), Quat::Identity(), Quat::Identity()};
    std::array<Vec6, 3> u{Vec6::Zero(), Vec6::Zero(), Vec6::Zero()};
  };
  double depth(const State& s, std::size_t i) const {
    const int b = field[i];
    return -(s.q[b] * plane_normal[b])
                .dot(s.x[0] + s.q[0] * point[i] - s.x[b] - s.q[b] * plane_point[b]);
  }
  std::array<Vec6, 3> wrenches(const State& s) const {
    std::vector<double> column[7], kappa(point.size()), slack(point.size());
    for (std::size_t i = 0; i < point.size(); ++i) {
      const Vec3 r = s.q[0] * point[i], n = s.q[0] * normal[i];
      const Vec6 &a = s.u[0], &b = s.u[field[i]];
      const Vec3 rb = s.x[0] + r - s.x[field[i]];
      const double rate =
          n.dot(a.head<3>() + a.tail<3>().cross(r)) - n.dot(b.head<3>() + b.tail<3>().cross(rb));
      for (int axis = 0; axis < 3; ++axis) {
        column[axis].push_back(n[axis]);
        column[3 + axis].push_back(r[axis]);
      }
      column[6].push_back(depth(s, i) - beta * rate);
    }
    const kernels::SeriesColumnsT<double> view{column[0].data(), column[1].data(), column[2].data(),
                                               column[3].data(), column[4].data(), column[5].data(),
                                               column[6].data(), nullptr,          point.size()};
    double y[6] = {};
    kernels::series_solve_ref(view, {c, lever, 1e-13, 40}, y, kappa.data(), slack.data());
    std::array<Vec6, 3> w{Vec6::Zero(), Vec6::Zero(), Vec6::Zero()};
    for (std::size_t i = 0; i < point.size(); ++i) {
      const Vec3 f = k * kappa[i] * slack[i] * (s.q[0] * normal[i]), r = s.q[0] * point[i];
      const Vec3 rb = s.x[0] + r - s.x[field[i]];
      w[0].head<3>() += f, w[0].tail<3>() += r.cross(f);
      w[field[i]].head<3>() -= f, w[field[i]].tail<3>() -= rb.cross(f);
    }
    return w;
  }
  static State moved(State s, int body, const Vec6& dq) {
    s.x[body] += dq.head<3>();
    s.q[body] = exp_rotation(dq.tail<3>()) * s.q[body];
    return s;
  }
};

World corner() {
  std::mt19937_64 random(21);
  World w;
  for (int i = 0; i < 50; ++i) {
    const bool floor = i < 30;
    w.field.push_back(floor ? 1 : 2);
    w.normal.push_back(
        ((floor ? Vec3(0, 0, 1) : Vec3(1, 0, 0)) + 0.4 * vector(random)).normalized());
    const Vec3 v = vector(random);
    w.point.push_back(floor ? Vec3(10 * mm * v.x(), 10 * mm * v.y(), (-5 + 0.2 * v.z()) * mm)
                            : Vec3((-10 + 0.2 * v.x()) * mm, 8 * mm * v.y(), 4 * mm * v.z()));
  }
  w.plane_normal[1] = Vec3(0.01, -0.02, 1).normalized();
  w.plane_normal[2] = Vec3(1, 0.02, 0.01).normalized();
  w.plane_point[1] = Vec3(1 * mm, 0, 8 * mm);
  w.plane_point[2] = Vec3(7 * mm, 0, 2 * mm);
  return w;
}

}  // namespace

TEST_CASE("series: all gradients of a body between two moving fields are derivatives") {
  const World world = corner();
  World::State state;
  state.x = {Vec3::Zero(), Vec3(0, 1 * mm, -12.9 * mm), Vec3(-16.9 * mm, 0, 1 * mm)};

  test::FieldArrays field = test::sample_analytic([](double, double, double z) { return z; },
                                                  {0, 0, -4 * mm}, mm, 1, 1, 1);
  test::ShellArrays shell = test::bottom_face(1 * mm, 1 * mm, 1 * mm, 10, 10);
  test::Model model({test::def_of(field)}, {shell.def()});
  std::array<h6BodyDef, 3> bodies{h6DefaultBodyDef(), h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].shell = 0;
  for (int b : {1, 2}) {
    bodies[b].field = 0;
    bodies[b].inertia[0] = bodies[b].inertia[1] = bodies[b].inertia[2] = 1e-5;
  }
  h6SessionDef def = h6DefaultSessionDef();
  def.gradient = H6_EXACT;
  def.contact.method = H6_METHOD_SERIES;
  def.bodies = bodies.data(), def.body_count = 3;
  h6Error error;
  h6Session* s = h6CreateSession(model.handle, &def, &error);
  REQUIRE_MESSAGE(s, error.message);
  s->bodies[0].radius = world.lever;
  for (int b = 0; b < 3; ++b) s->bodies[b].x = state.x[b];
  keep_all_awake(*s);
  wake_pairs(*s);
  ShellBody& touching = s->shells[0];
  REQUIRE(touching.pairs.size() == 2);
  Contacts& c = touching.contacts;
  c.count = world.point.size();
  int inside = 0;
  for (std::size_t i = 0; i < c.count; ++i) {
    const Vec3 &r = world.point[i], &n = world.normal[i], &g = world.plane_normal[world.field[i]];
    const auto put = [&](float* x, float* y, float* z, const Vec3& v) {
      x[i] = float(v.x()), y[i] = float(v.y()), z[i] = float(v.z());
    };
    c.depth[i] = static_cast<float>(world.depth(state, i));
    inside += c.depth[i] > 0;
    put(c.nx, c.ny, c.nz, n), put(c.gx, c.gy, c.gz, g), put(c.rx, c.ry, c.rz, r);
  }
  REQUIRE(inside > 20);
  Pair &floor = touching.pairs[0], &wall = touching.pairs[1];
  floor.begin = 0, floor.end = wall.begin = 30, wall.end = 50;
  sched::FrameTeam alone(1);
  Scratch scratch;
  Lane lane;
  lane.team = &alone;
  lane.scratch = &scratch;
  weigh_series(s->settings, s->bodies, touching, lane);
  CHECK(lane.report.series_residual <= 1e-6);
  sum_contacts(s->settings, s->bodies, touching, lane);
  for (LinearWrench& acting : s->acting) acting.set_zero();
  add_wrenches(s->settings, s->bodies, touching, s->acting);

  const auto w = world.wrenches(state);
  for (int b = 0; b < 3; ++b) {
    REQUIRE(w[b].norm() > 0.1);
    CHECK((s->acting[b].f - w[b]).norm() < 1e-4 * w[b].norm());
  }
  const std::span<LinearWrench> on = s->acting;
  const BetweenBodies &ap = *floor.between, &aq = *wall.between;
  const BetweenFields &p = *floor.of_fields, &q = *wall.of_fields;
  const Mat6 K[3][3] = {{on[0].K, ap.Kab, aq.Kab},
                        {ap.Kba, on[1].K, p.left * q.right},
                        {aq.Kba, q.left * p.right, on[2].K}};
  const Mat6 D[3][3] = {{on[0].D, ap.Dab, aq.Dab},
                        {ap.Dba, on[1].D, world.beta * p.left * q.right_d},
                        {aq.Dba, world.beta * q.left * p.right_d, on[2].D}};
  for (int by = 0; by < 3; ++by) {
    Mat6 numeric[3], numeric_d[3];
    for (int i = 0; i < 6; ++i) {
      const double h = i < 3 ? 1e-9 : 1e-7;
      Vec6 dq = Vec6::Zero();
      dq[i] = h;
      const auto up = world.wrenches(World::moved(state, by, dq)),
                 down = world.wrenches(World::moved(state, by, -dq));
      World::State faster = state, slower = state;
      faster.u[by][i] += 1e-6, slower.u[by][i] -= 1e-6;
      const auto fast = world.wrenches(faster), slow = world.wrenches(slower);
      for (int b = 0; b < 3; ++b) {
        numeric[b].col(i) = (up[b] - down[b]) / (2 * h);
        numeric_d[b].col(i) = (fast[b] - slow[b]) / 2e-6;
      }
    }
    for (int b = 0; b < 3; ++b)
      for (int r = 0; r < 6; r += 3)
        for (int col = 0; col < 6; col += 3) {
          CAPTURE(b);
          CAPTURE(by);
          CAPTURE(r);
          CAPTURE(col);
          const Mat3 k = numeric[b].block<3, 3>(r, col);
          CHECK((K[b][by].block<3, 3>(r, col) - k).norm() < 3e-4 * k.norm());
          // Damping counts with the normals, not the field's gradient.
          const Mat3 d = numeric_d[b].block<3, 3>(r, col);
          CHECK((D[b][by].block<3, 3>(r, col) - d).norm() < 3e-4 * d.norm());
        }
  }
  h6DestroySession(s);
}

namespace {

// A box of 144 points over a floor, held by a hand.
struct BoxOnPlane {
  test::FieldArrays field = test::sample_analytic([](double, double, double z) { return z; },
                                                  {-32 * mm, -32 * mm, -16 * mm}, mm, 8, 8, 4);
  test::ShellArrays shell = test::bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12);
  test::Model model{{test::def_of(field)}, {shell.def()}};
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  h6Session* session = nullptr;
  explicit BoxOnPlane(double height) {
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0, bodies[1].pose = pose(0, 0, height);
    hand.body = 1;
    def.bodies = bodies.data(), def.body_count = 2;
    def.contact.method = H6_METHOD_SERIES;
  }
  void open() {
    h6Error error;
    session = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
  ~BoxOnPlane() { h6DestroySession(session); }
};

}  // namespace

TEST_CASE("series: at rest on a wall the net stiffness lies between k and c k") {
  for (const double c : {2.5, 4.0}) {
    BoxOnPlane box(5.2 * mm);
    box.def.contact.series_c = c;
    box.def.hands = &box.hand, box.def.hand_count = 1;
    box.open();
    const h6DeviceSample sample = test::hand_at(pose(0, 0, 4 * mm));
    for (int i = 0; i < 3000; ++i) h6Step(box.session, &sample, nullptr);
    const double depth = h6GetFrame(box.session).max_depth;
    const double net = 1e3 * (mm - depth) / (1e4 * depth);  // k_VC (1 mm - depth) = net k depth
    CHECK(net > 1);
    CHECK(net <= c * (1 + 1e-3));
    CHECK(net > 0.9 * c);  // 144 contacts: nearly all of the spring
  }
}

TEST_CASE("series: a point takes part before it touches only where it can carry load") {
  // 0.1 voxel above the floor; damping makes an approach by 0.15 m/s count 0.15 voxel ahead.
  const auto first_frame = [](double speed, double margin) {
    BoxOnPlane box(5.1 * mm);
    box.def.contact.margin_voxels = margin;
    box.open();
    const h6BodyState state{pose(0, 0, 5.1 * mm), {{0, 0, speed}, {0, 0, 0}}};
    h6SetBody(box.session, 1, &state);
    h6Step(box.session, nullptr, nullptr);
    CHECK(h6GetFrame(box.session).contacts == 0);
    CHECK(h6GetFrame(box.session).max_depth == 0);
    const h6Contacts c = h6GetContacts(box.session, 1);
    for (std::size_t i = 0; i < c.count; ++i) {
      CHECK(c.depth[i] == h6::test::near(-0.1 * mm).epsilon(0.01));
      CHECK(c.weight[i] == 0);
      CHECK(c.load[i] > 0);
    }
    return c.count;
  };
  CHECK(first_frame(-0.15, 0.25) == 144);
  CHECK(first_frame(-0.15, 0.05) == 0);
  CHECK(first_frame(0, 0.25) == 0);
  CHECK(first_frame(0.15, 0.25) == 0);
}

TEST_CASE("series and firm find contacts again after a wild state, and one that was refused") {
  for (const h6Method method : {H6_METHOD_SERIES, H6_METHOD_FIRM}) {
    BoxOnPlane box(4.9 * mm);
    box.def.contact.method = method;
    box.open();
    for (const double wild : {1e6, 1e300, std::nan("")}) {
      const h6BodyState state{pose(0, 0, 4.9 * mm), {{0, 0, wild}, {wild, 0, 0}}};
      h6SetBody(box.session, 1, &state);
      h6Step(box.session, nullptr, nullptr);
    }
    const h6BodyState rest{pose(0, 0, 4.9 * mm), {}};
    h6SetBody(box.session, 1, &rest);
    h6Step(box.session, nullptr, nullptr);
    const h6Contacts c = h6GetContacts(box.session, 1);
    CHECK(c.count == 144);
    for (std::size_t i = 0; i < c.count; ++i) CHECK(c.load[i] > 0);
    CHECK(std::isfinite(h6GetBody(box.session, 1).pose.p.z));
  }
}

TEST_CASE("series: beyond the band distances are bounds, and no contact is made of them") {
  // A band of less than a voxel, a shell 1.5 voxels away, the largest margin.
  test::FieldArrays field = test::sample_analytic([](double, double, double z) { return z; },
                                                  {-32 * mm, -32 * mm, -24 * mm}, mm, 8, 8, 6, 0.5);
  for (float& bound : field.far) bound *= 0.01f;  // poor ones, as they may be
  test::ShellArrays shell = test::bottom_face(10 * mm, 10 * mm, 5 * mm, 12, 12);
  test::Model model({test::def_of(field)}, {shell.def()});
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies.data(), def.body_count = 2;
  def.contact.method = H6_METHOD_SERIES;
  def.contact.margin_voxels = 2;
  for (const double gap : {1.5, 9.0, 12.0}) {
    bodies[1].pose = pose(0, 0, (5 + gap) * mm);
    h6Session* s = h6CreateSession(model.handle, &def, nullptr);
    REQUIRE(s);
    h6Step(s, nullptr, nullptr);
    const h6Contacts c = h6GetContacts(s, 1);
    for (std::size_t i = 0; i < c.count; ++i)
      CHECK(c.depth[i] == h6::test::near(-gap * mm).epsilon(0.01));
    h6DestroySession(s);
  }
}

TEST_CASE("series: loads never pull and every frame reports how well the solve converged") {
  test::FieldArrays bowl = test::sample_analytic(
      [](double x, double y, double z) { return 20.2 * mm - std::sqrt(x * x + y * y + z * z); },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  test::ShellArrays ball = test::sphere_points(20 * mm, 5000);
  test::Model model({test::def_of(bowl)}, {ball.def()});
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0;
  h6HandDef hand = h6DefaultHandDef();
  hand.body = 1;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies.data(), def.body_count = 2;
  def.hands = &hand, def.hand_count = 1;
  def.contact.method = H6_METHOD_SERIES;
  h6Session* s = h6CreateSession(model.handle, &def, nullptr);
  REQUIRE(s);
  std::uint32_t most = 0, touched = 0;
  for (int i = 0; i < 500; ++i) {
    h6DeviceSample sample = test::hand_at(
        pose(2 * mm * std::sin(0.02 * i), 1.5 * mm * std::cos(0.013 * i), mm * std::sin(0.05 * i)));
    h6Step(s, &sample, nullptr);
    const h6FrameReport frame = h6GetFrame(s);
    most = std::max(most, frame.series_iterations);
    touched = std::max(touched, frame.contacts);
    CHECK(frame.series_residual <= 1e-6);
    const h6Contacts c = h6GetContacts(s, 1);
    float least = 0;
    for (std::size_t k = 0; k < c.count; ++k) least = std::min({least, c.load[k], c.weight[k]});
    CHECK(least >= 0);
  }
  CHECK(touched > 100);
  CHECK(most >= 1);
  CHECK(most <= 12);
  h6DestroySession(s);
}

TEST_CASE("series: a body wedged between two moving fields keeps the momentum of all three") {
  // Two free balls, pushed apart by a free wedge that hits both at once: nothing else acts.
  test::FieldArrays ball = test::sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - 10 * mm; },
      {-16 * mm, -16 * mm, -16 * mm}, mm, 4, 4, 4);
  test::ShellArrays box = test::bottom_face(12 * mm, 6 * mm, 5 * mm, 48, 24);
  for (const h6Gradient gradient : {H6_SYMMETRIC, H6_EXACT}) {
    test::Model model({test::def_of(ball)}, {box.def()});
    std::array<h6BodyDef, 3> bodies{h6DefaultBodyDef(), h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].shell = 0;
    bodies[0].pose = pose(0, 0, 15.4 * mm);
    bodies[0].velocity.linear = {0.01, 0, -0.2};
    for (int b : {1, 2}) {
      bodies[b].field = 0;
      bodies[b].mass = 0.2;
      bodies[b].pose = pose(b == 1 ? -10.5 * mm : 10.5 * mm, 0, 0);
      bodies[b].inertia[0] = bodies[b].inertia[1] = bodies[b].inertia[2] = 8e-6;
    }
    h6SessionDef def = h6DefaultSessionDef();
    def.gradient = gradient;
    def.contact.method = H6_METHOD_SERIES;
    def.bodies = bodies.data(), def.body_count = 3;
    h6Session* s = h6CreateSession(model.handle, &def, nullptr);
    REQUIRE(s);
    bool both = false;
    double worst = 0;
    for (int i = 0; i < 100; ++i) {
      h6Step(s, nullptr, nullptr);
      bool touched[3] = {};
      const h6Contacts c = h6GetContacts(s, 0);
      for (std::size_t k = 0; k < c.count; ++k)
        if (c.load[k] > 0) touched[c.field_body[k]] = true;
      both = both || (touched[1] && touched[2]);
      Vec3 momentum = -0.1 * Vec3(0.01, 0, -0.2);
      for (int b = 0; b < 3; ++b)
        momentum += bodies[b].mass * from(h6GetBody(s, b).velocity.linear);
      worst = std::max(worst, momentum.norm());
    }
    CHECK(both);
    CHECK((h6GetFrame(s).status & H6_SOLVE_FAILED) == 0);
    for (int b : {1, 2}) CHECK(h6GetBody(s, b).velocity.linear.z < -0.005);  // both were hit
    CHECK(worst < 1e-8);
    h6DestroySession(s);
  }
}
