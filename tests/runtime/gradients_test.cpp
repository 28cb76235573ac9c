// The derivatives that the implicit step relies on, against central differences of the forces.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include <array>
#include <random>

#include "hapsix/hapsix.h"
#include "kernels/contact_wrench.h"
#include "runtime/stages.h"
#include "tests/support/analytic.h"

using namespace h6;
using test::pose;

namespace {

constexpr double mm = 1e-3;

double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
}  // [-1, 1)
Vec3 vector(std::mt19937_64& random) { return {uniform(random), uniform(random), uniform(random)}; }

// Contacts against a plane field of a moving body, all in double: the specification itself, moved.
struct Planes {
  std::vector<Vec3> point, normal;  // of shell body a, relative to its centre of mass
  Vec3 plane_normal, plane_point;   // of field body b, relative to its centre of mass
  double k = 1e4, beta = 1e-3;

  struct State {
    Vec3 xa = Vec3::Zero(), xb = Vec3::Zero();
    Quat qa = Quat::Identity(), qb = Quat::Identity();
    Vec6 ua = Vec6::Zero(), ub = Vec6::Zero();
  };
  struct Wrenches {
    Vec6 a, b;
  };

  // Straight from METHOD.md Sec. 2, contact by contact.
  Wrenches wrenches(const State& s) const {
    Wrenches w{Vec6::Zero(), Vec6::Zero()};
    const Vec3 g = s.qb * plane_normal, o = s.xb + s.qb * plane_point;
    for (std::size_t i = 0; i < point.size(); ++i) {
      const Vec3 r = s.qa * point[i], n = s.qa * normal[i], p = s.xa + r, rb = p - s.xb;
      const double d = g.dot(p - o);
      const double rate = n.dot(s.ua.head<3>() + s.ua.tail<3>().cross(r)) -
                          n.dot(s.ub.head<3>() + s.ub.tail<3>().cross(rb));
      const Vec3 f = k * (-d - beta * rate) * n;
      w.a.head<3>() += f;
      w.a.tail<3>() += r.cross(f);
      w.b.head<3>() -= f;
      w.b.tail<3>() -= rb.cross(f);
    }
    return w;
  }
  static State moved(State s, int body, const Vec6& dq) {
    (body == 0 ? s.xa : s.xb) += dq.head<3>();
    Quat& q = body == 0 ? s.qa : s.qb;
    q = exp_rotation(dq.tail<3>()) * q;
    return s;
  }
};

}  // namespace

TEST_CASE("the exact contact gradients of both bodies are the derivatives of the wrenches") {
  std::mt19937_64 random(7);
  Planes scene;
  for (int i = 0; i < 40; ++i) {
    scene.normal.push_back((Vec3(0, 0, 1) + 0.4 * vector(random)).normalized());
    scene.point.push_back(Vec3(10 * mm, 10 * mm, 0.05 * mm).cwiseProduct(vector(random)));
  }
  scene.plane_normal = Vec3(0.1, -0.05, 1).normalized();
  scene.plane_point = Vec3(0, 0, 33 * mm);
  Planes::State state;
  state.xa = Vec3(1 * mm, 2 * mm, 29 * mm);
  state.qa = exp_rotation({0.02, -0.01, 0.3});
  state.ua << 0.01, 0.02, -0.01, 0.3, -0.2, 0.1;
  state.ub << -0.01, 0.01, 0.02, 0.1, 0.1, -0.2;

  // The engine's own stage, fed with these contacts through a session's arrays.
  test::FieldArrays field = test::sample_analytic([](double, double, double z) { return z; },
                                                  {0, 0, -4 * mm}, mm, 1, 1, 1);
  test::ShellArrays shell = test::bottom_face(1 * mm, 1 * mm, 1 * mm, 7, 6);
  test::Model model({test::def_of(field)}, {shell.def()});
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].shell = 0;
  bodies[1].field = 0;
  bodies[1].inertia[0] = bodies[1].inertia[1] = bodies[1].inertia[2] = 1e-5;
  h6SessionDef def = h6DefaultSessionDef();
  def.gradient = H6_EXACT;
  def.bodies = bodies.data(), def.body_count = 2;
  h6Error error;
  h6Session* s = h6CreateSession(model.handle, &def, &error);
  REQUIRE_MESSAGE(s, error.message);
  REQUIRE(s->pair_count == 1);
  Body &a = s->bodies[0], &b = s->bodies[1];
  a.x = state.xa, a.q = state.qa, a.R = state.qa.toRotationMatrix(), b.x = state.xb;
  a.v = state.ua.head<3>(), a.w = state.ua.tail<3>(), b.v = state.ub.head<3>(),
  b.w = state.ub.tail<3>();
  Contacts& c = s->contacts[0];
  c.count = scene.point.size();
  const Vec3 g = scene.plane_normal;
  for (std::size_t i = 0; i < c.count; ++i) {
    const Vec3 r = state.qa * scene.point[i], n = state.qa * scene.normal[i];
    c.depth[i] = static_cast<float>(-g.dot(state.xa + r - scene.plane_point));
    REQUIRE(c.depth[i] > 0);
    c.weight[i] = 1;
    c.nx[i] = static_cast<float>(n.x()), c.ny[i] = static_cast<float>(n.y()),
    c.nz[i] = static_cast<float>(n.z());
    c.gx[i] = static_cast<float>(g.x()), c.gy[i] = static_cast<float>(g.y()),
    c.gz[i] = static_cast<float>(g.z());
    c.rx[i] = static_cast<float>(r.x()), c.ry[i] = static_cast<float>(r.y()),
    c.rz[i] = static_cast<float>(r.z());
  }
  s->pairs[0].begin = 0;
  s->pairs[0].end = c.count;
  sum_wrench(*s, s->pairs[0]);

  // The stage keeps contacts in float; the difference quotient is in double.
  const Planes::Wrenches w = scene.wrenches(state);
  CHECK((a.f - w.a).norm() < 2e-5 * w.a.norm());
  CHECK((b.f - w.b).norm() < 2e-5 * w.b.norm());
  // The undamped forces: METHOD.md keeps damping's own geometry out of K.
  Planes elastic = scene;
  elastic.beta = 0;
  Mat6 numeric[2][2], numeric_d[2][2];
  for (int by = 0; by < 2; ++by)
    for (int i = 0; i < 6; ++i) {
      const double step = i < 3 ? 1e-7 : 1e-5;
      Vec6 dq = Vec6::Zero();
      dq[i] = step;
      const auto up = elastic.wrenches(Planes::moved(state, by, dq)),
                 down = elastic.wrenches(Planes::moved(state, by, -dq));
      numeric[0][by].col(i) = (up.a - down.a) / (2 * step);
      numeric[1][by].col(i) = (up.b - down.b) / (2 * step);
      Planes::State faster = state, slower = state;
      (by == 0 ? faster.ua : faster.ub)[i] += 1e-3;
      (by == 0 ? slower.ua : slower.ub)[i] -= 1e-3;
      numeric_d[0][by].col(i) = (scene.wrenches(faster).a - scene.wrenches(slower).a) / 2e-3;
      numeric_d[1][by].col(i) = (scene.wrenches(faster).b - scene.wrenches(slower).b) / 2e-3;
    }
  const Pair& pair = s->pairs[0];
  const auto close = [](const Mat6& mine, const Mat6& reference) {
    // Translation and rotation have different units: compare block by block.
    for (int r = 0; r < 6; r += 3)
      for (int col = 0; col < 6; col += 3) {
        const Mat3 m = mine.block<3, 3>(r, col), n = reference.block<3, 3>(r, col);
        CAPTURE(r);
        CAPTURE(col);
        CHECK((m - n).norm() < 2e-5 * n.norm() + 1e-9);
      }
  };
  close(a.K, numeric[0][0]);
  close(pair.Kab, numeric[0][1]);
  close(pair.Kba, numeric[1][0]);
  close(b.K, numeric[1][1]);
  close(a.D, numeric_d[0][0]);
  close(pair.Dab, numeric_d[0][1]);
  close(pair.Dba, numeric_d[1][0]);
  close(b.D, numeric_d[1][1]);
  h6DestroySession(s);
}

TEST_CASE(
    "the coupling's gradients are the derivatives of its wrench, below and above saturation") {
  test::FieldArrays field = test::sample_analytic([](double, double, double z) { return z; },
                                                  {0, 0, -4 * mm}, mm, 1, 1, 1);
  test::ShellArrays shell = test::bottom_face(10 * mm, 8 * mm, 5 * mm, 5, 5);
  test::Model model({test::def_of(field)}, {shell.def()});
  for (const double reach : {0.3, 10.0}) {
    std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    bodies[1].com = {1 * mm, -2 * mm, 0.5 * mm};
    h6HandDef hand = h6DefaultHandDef();
    hand.body = 1;
    hand.coupling.rotational_stiffness = 0.9;
    h6SessionDef def = h6DefaultSessionDef();
    def.gradient = H6_EXACT;
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    h6Error error;
    h6Session* s = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(s, error.message);
    Hand& h = s->hands[0];
    h.seen = true;
    h.sample = test::hand_at({{reach * 3 * mm, reach * mm, reach * -2 * mm}, {1, 0, 0, 0}});
    h.sample.pose.q = to(exp_rotation(Vec3(0.05, -0.1, 0.07) * reach * 1.2));
    h.sample.velocity = {{0.01, 0.02, -0.01}, {0.2, 0.1, -0.3}};
    Body& body = s->bodies[1];
    body.v = {0.02, -0.01, 0.03};
    body.w = {0.1, 0.2, 0.05};
    const auto wrench = [&](const Body& at) {
      const Body saved = body;
      body = at;
      couple(*s, h);
      const Vec6 w = h.wrench;
      body = saved;
      return w;
    };
    body.K.setZero(), body.D.setZero(), body.f.setZero();
    s->report.status = 0;
    couple(*s, h);
    CHECK(((s->report.status & H6_COUPLING_SATURATED) != 0) == (reach > 1));
    const Mat6 K = body.K, D = body.D;
    CHECK((body.f - h.wrench).norm() == 0);
    Mat6 numeric_k, numeric_d;
    for (int i = 0; i < 6; ++i) {
      const double step = 1e-6;
      Body up = body, down = body;
      if (i < 3) {
        up.x[i] += step, down.x[i] -= step;
      } else {
        Vec3 w = Vec3::Zero();
        w[i - 3] = step;
        up.q = exp_rotation(w) * body.q, down.q = exp_rotation(-w) * body.q;
      }
      numeric_k.col(i) = (wrench(up) - wrench(down)) / (2 * step);
      up = down = body;
      (i < 3 ? up.v[i] : up.w[i - 3]) += step;
      (i < 3 ? down.v[i] : down.w[i - 3]) -= step;
      numeric_d.col(i) = (wrench(up) - wrench(down)) / (2 * step);
    }
    CHECK((K - numeric_k).norm() < 1e-6 * K.norm());
    CHECK((D - numeric_d).norm() < 1e-6 * D.norm());
    h6DestroySession(s);
  }
}

TEST_CASE("rotation logarithm and exponential undo each other") {
  std::mt19937_64 random(3);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 w = 3.1 * std::abs(uniform(random)) * vector(random).normalized();
    CHECK((log_rotation(exp_rotation(w)) - w).norm() < 1e-12 + 1e-9 * w.norm());
  }
  CHECK(log_rotation(exp_rotation(Vec3::Zero())).norm() == 0);
  CHECK((log_rotation(exp_rotation({1e-10, 0, 0})) - Vec3(1e-10, 0, 0)).norm() < 1e-20);
}
