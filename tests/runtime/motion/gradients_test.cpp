// SPDX-License-Identifier: Apache-2.0
// The derivatives that the implicit step relies on, against central differences of the forces, in
// double: one shell body against analytic fields on three bodies, all of them moving and turned.
//
// The forces are summed here contact by contact, straight from METHOD.md; the derivatives come from
// the engine's own assembly, fed with the sums of the kernel's specification in double.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "hapsix/hapsix.h"
#include "kernels/contact/contact_wrench.h"
#include "kernels/weights/series_solve.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/weighing.h"
#include "runtime/frame/session.h"
#include "tests/support/analytic.h"

using namespace h6;

namespace {

constexpr double mm = 1e-3;
constexpr int kBodies = 4;  // 0: the shell; fields: 1 plane, 2 ball, 3 cylinder

double uniform(std::mt19937_64& random) {
  return std::ldexp(static_cast<double>(random() >> 11), -52) - 1;
}  // [-1, 1)
Vec3 vector(std::mt19937_64& random) { return {uniform(random), uniform(random), uniform(random)}; }

// Distances in a field body's own axes about its centre of mass, with their gradients.
struct Sample {
  double d;
  Vec3 g;
};
Sample sample(int field, const Vec3& p) {
  if (field == 1) {
    const Vec3 n = Vec3(0.1, -0.05, 1).normalized();
    return {n.dot(p) - 4 * mm, n};
  }
  const Vec3 c(2 * mm, -1 * mm, 3 * mm);  // not at the centre of mass
  const Vec3 q = field == 2 ? Vec3(p - c) : Vec3(p.x() - c.x(), p.y() - c.y(), 0);
  return {q.norm() - (field == 2 ? 12 * mm : 9 * mm), q.normalized()};
}

struct State {
  std::array<Vec3, kBodies> x;
  std::array<Quat, kBodies> q;
  std::array<Vec6, kBodies> u;
};
using Wrenches = std::array<Vec6, kBodies>;

struct Scene {
  std::vector<Vec3> point, normal;  // in the shell body's axes, about its centre of mass
  std::vector<double> weight;       // frozen
  std::array<std::size_t, kBodies> first{}, end{};  // the rows of each field
  double k = 1e4, beta = 1e-3, c = 4, lever = 0.04;
  State at;

  Scene() {
    std::mt19937_64 random(7);
    at.x = {Vec3(3, -2, 5) * mm, Vec3(1, 4, -20) * mm, Vec3(30, 5, 0) * mm, Vec3(-2, 28, 9) * mm};
    for (int b = 0; b < kBodies; ++b) {
      at.q[b] = exp_rotation(1.5 * vector(random));
      at.u[b] << 0.02 * vector(random), 0.5 * vector(random);
    }
    for (int b = 1; b < kBodies; ++b) {
      first[b] = point.size();
      for (int i = 0; i < 25; ++i) add_contact(b, random);
      end[b] = point.size();
    }
  }

  // A point 0.15 mm to 0.45 mm inside field b, near the side that faces the shell's centre.
  void add_contact(int b, std::mt19937_64& random) {
    Vec3 p = at.q[b].conjugate() * (at.x[0] - at.x[b] + 8 * mm * vector(random));
    const double depth = (0.3 + 0.15 * uniform(random)) * mm;
    for (int i = 0; i < 3; ++i) {
      const Sample s = sample(b, p);
      p -= (s.d + depth) * s.g;
    }
    const Vec3 world = at.x[b] + at.q[b] * p, g = at.q[b] * sample(b, p).g;
    point.push_back(at.q[0].conjugate() * (world - at.x[0]));
    normal.push_back(at.q[0].conjugate() * (g + 0.4 * vector(random)).normalized());
    weight.push_back(0.7 + 0.5 * uniform(random));
  }

  int field_of(std::size_t i) const { return i < end[1] ? 1 : i < end[2] ? 2 : 3; }
  Sample field_at(const State& s, int b, const Vec3& world) const {
    const Sample v = sample(b, s.q[b].conjugate() * (world - s.x[b]));
    return {v.d, s.q[b] * v.g};
  }
  double depth(const State& s, std::size_t i) const {
    return -field_at(s, field_of(i), s.x[0] + s.q[0] * point[i]).d;
  }
  // How fast point i of the shell leaves the field along its own normal.
  double rate(const State& s, std::size_t i) const {
    const int b = field_of(i);
    const Vec3 r = s.q[0] * point[i], n = s.q[0] * normal[i], rb = s.x[0] + r - s.x[b];
    return n.dot(s.u[0].head<3>() + s.u[0].tail<3>().cross(r)) -
           n.dot(s.u[b].head<3>() + s.u[b].tail<3>().cross(rb));
  }
  std::vector<double> rates(const State& s) const {
    std::vector<double> out;
    for (std::size_t i = 0; i < point.size(); ++i) out.push_back(rate(s, i));
    return out;
  }
  // Wrenches of contact forces k load_i N_i, Sec. 2.
  Wrenches wrenches(const State& s, const std::vector<double>& load) const {
    Wrenches w;
    w.fill(Vec6::Zero());
    for (std::size_t i = 0; i < point.size(); ++i) {
      const int b = field_of(i);
      const Vec3 r = s.q[0] * point[i], f = k * load[i] * (s.q[0] * normal[i]);
      w[0].head<3>() += f, w[0].tail<3>() += r.cross(f);
      w[b].head<3>() -= f, w[b].tail<3>() -= (s.x[0] + r - s.x[b]).cross(f);
    }
    return w;
  }
  static State moved(State s, int body, const Vec6& dq) {
    s.x[body] += dq.head<3>();
    s.q[body] = exp_rotation(dq.tail<3>()) * s.q[body];
    return s;
  }
  static State faster(State s, int body, const Vec6& du) {
    s.u[body] += du;
    return s;
  }
};

// Contacts of a scene as columns of doubles (or floats, for the frame's own stage).
template <class T>
struct Columns {
  std::vector<T> n[3], g[3], r[3], depth, weight;
  Columns(const Scene& scene, const State& s) : weight(scene.weight.begin(), scene.weight.end()) {
    for (std::size_t i = 0; i < scene.point.size(); ++i) {
      const Vec3 arm = s.q[0] * scene.point[i], normal = s.q[0] * scene.normal[i];
      const Sample field = scene.field_at(s, scene.field_of(i), s.x[0] + arm);
      for (int axis = 0; axis < 3; ++axis) {
        n[axis].push_back(static_cast<T>(normal[axis]));
        g[axis].push_back(static_cast<T>(field.g[axis]));
        r[axis].push_back(static_cast<T>(arm[axis]));
      }
      depth.push_back(static_cast<T>(-field.d));
    }
  }
  kernels::WrenchColumnsT<T> with(const std::vector<T>& e, const std::vector<T>& share) const {
    return {e.data(),    share.data(), n[0].data(), n[1].data(), n[2].data(), g[0].data(),
            g[1].data(), g[2].data(),  r[0].data(), r[1].data(), r[2].data(), e.size()};
  }
};

// The part of a session that the assembly reads: one shell body against all others.
struct Assembly {
  std::array<Body, kBodies> bodies;
  std::array<LinearWrench, kBodies> acting;
  std::array<Pair, kBodies - 1> pairs;
  std::array<BetweenBodies, kBodies - 1> between;
  std::array<BetweenFields, kBodies - 1> of_fields;
  std::array<Pair*, kBodies - 1> list;
  ShellBody shell;
  Settings set;
  explicit Assembly(const Scene& scene) {
    for (int b = 0; b < kBodies; ++b) {
      acting[b].set_zero();
      bodies[b].fixed = false;
      bodies[b].x = scene.at.x[b];
      bodies[b].q = scene.at.q[b];
      bodies[b].R = scene.at.q[b].toRotationMatrix();
      bodies[b].v = scene.at.u[b].head<3>(), bodies[b].w = scene.at.u[b].tail<3>();
    }
    bodies[0].radius = scene.lever;
    for (int b = 1; b < kBodies; ++b) {
      pairs[b - 1].a = 0, pairs[b - 1].b = b;
      pairs[b - 1].begin = scene.first[b], pairs[b - 1].end = scene.end[b];
      pairs[b - 1].between = &between[b - 1], pairs[b - 1].of_fields = &of_fields[b - 1];
      list[b - 1] = &pairs[b - 1];
    }
    shell.body = 0;
    shell.pairs = PairList(list);
    set.gradient = H6_EXACT;
    set.contact = h6DefaultContactDef();
    set.contact.method = H6_METHOD_ROBUST;
    set.contact.stiffness = scene.k, set.contact.damping = scene.beta;
    set.contact.series_c = scene.c;
  }
  // How the wrench on body `on` changes with the motion, or velocity, of body `by`.
  Mat6 K(int on, int by) const {
    if (on == by) return acting[on].K;
    if (on == 0) return between[by - 1].Kab;
    if (by == 0) return between[on - 1].Kba;
    return of_fields[on - 1].left * of_fields[by - 1].right;
  }
  Mat6 D(int on, int by) const {
    if (on == by) return acting[on].D;
    if (on == 0) return between[by - 1].Dab;
    if (by == 0) return between[on - 1].Dba;
    return set.contact.damping * of_fields[on - 1].left * of_fields[by - 1].right_d;
  }
  Vec6 velocity(const Pair& pair) const { return pair_velocity(bodies[pair.a], bodies[pair.b]); }
  void spread(Pair& pair, const kernels::WrenchSum& sum) {
    spread_wrench(set, sides_of(pair, bodies, acting), pair, sum);
  }
};

// Central difference of fourth order: the error of the second falls out.
template <class V, class F>
V derivative(double h, const F& f) {
  return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h);
}

// Columns d wrench on `on` / d (motion of `by`), for all pairs of bodies.
using Blocks = std::array<std::array<Mat6, kBodies>, kBodies>;
Blocks differences(double step, double turn,
                   const std::function<Wrenches(int body, const Vec6& dq)>& wrenches) {
  Blocks out;
  for (int by = 0; by < kBodies; ++by)
    for (int i = 0; i < 6; ++i) {
      using All = Eigen::Matrix<double, 6 * kBodies, 1>;
      const All column = derivative<All>(i < 3 ? step : turn, [&](double h) -> All {
        const Wrenches w = wrenches(by, h * Vec6::Unit(i));
        All all;
        for (int on = 0; on < kBodies; ++on) all.segment<6>(6 * on) = w[on];
        return all;
      });
      for (int on = 0; on < kBodies; ++on) out[on][by].col(i) = column.segment<6>(6 * on);
    }
  return out;
}

// Translation and rotation have different units: compared apart, each against its own size.
template <class Mine>
void check_blocks(const Mine& mine, const Blocks& reference, double tolerance) {
  for (int on = 0; on < kBodies; ++on)
    for (int by = 0; by < kBodies; ++by)
      for (int r = 0; r < 6; r += 3)
        for (int c = 0; c < 6; c += 3) {
          CAPTURE(on);
          CAPTURE(by);
          CAPTURE(r);
          CAPTURE(c);
          const Mat3 n = reference[on][by].template block<3, 3>(r, c);
          const Mat3 difference = mine(on, by).template block<3, 3>(r, c) - n;
          CHECK(difference.norm() <= tolerance * n.norm());
        }
}

}  // namespace

TEST_CASE(
    "the exact contact gradients of all bodies are the derivatives of the wrenches, to 1e-6") {
  const Scene scene;
  const Columns<double> columns(scene, scene.at);
  Assembly engine(scene);
  for (Pair& pair : engine.pairs) {
    kernels::WrenchParameters p{scene.k, scene.beta, {}, true};
    Vec6::Map(p.velocity) = engine.velocity(pair);
    engine.spread(pair, kernels::contact_wrench_ref(columns.with(columns.depth, columns.weight), p,
                                                    pair.begin, pair.end));
  }
  const auto wrenches = [&](const State& s, double beta) {
    std::vector<double> load(scene.point.size());
    for (std::size_t i = 0; i < load.size(); ++i) {
      const double depth = scene.depth(s, i), e = depth - beta * scene.rate(s, i);
      REQUIRE(std::min(depth, e) > 0);  // away from the kink
      load[i] = scene.weight[i] * e;
    }
    return scene.wrenches(s, load);
  };
  const Wrenches w = wrenches(scene.at, scene.beta);
  for (int b = 0; b < kBodies; ++b) CHECK((engine.acting[b].f - w[b]).norm() < 1e-12 * w[b].norm());

  // METHOD.md keeps damping's own geometry out of K: the elastic wrench alone.
  const Blocks K = differences(1e-5, 1e-4, [&](int body, const Vec6& dq) {
    return wrenches(Scene::moved(scene.at, body, dq), 0);
  });
  const Blocks D = differences(1e-3, 1e-2, [&](int body, const Vec6& du) {
    return wrenches(Scene::faster(scene.at, body, du), scene.beta);
  });
  // Fields feel one another only through the shell body: no blocks between them.
  for (BetweenFields& of : engine.of_fields) of.left.setZero();
  check_blocks([&](int on, int by) { return engine.K(on, by); }, K, 1e-6);
  check_blocks([&](int on, int by) { return engine.D(on, by); }, D, 1e-6);
}

TEST_CASE("the frame's own stage, with contacts in float, gives these gradients to 2e-5") {
  const Scene scene;
  const Columns<double> fine(scene, scene.at);
  Columns<float> columns(scene, scene.at);
  Assembly engine(scene), exact(scene);
  Contacts& contacts = engine.shell.contacts;
  contacts.depth = columns.depth.data(), contacts.weight = columns.weight.data();
  contacts.nx = columns.n[0].data(), contacts.ny = columns.n[1].data(),
  contacts.nz = columns.n[2].data();
  contacts.gx = columns.g[0].data(), contacts.gy = columns.g[1].data(),
  contacts.gz = columns.g[2].data();
  contacts.rx = columns.r[0].data(), contacts.ry = columns.r[1].data(),
  contacts.rz = columns.r[2].data();
  contacts.count = contacts.capacity = columns.depth.size();
  sched::FrameTeam team(1);
  Lane lane;
  lane.team = &team;
  sum_contacts(engine.set, engine.bodies, engine.shell, lane);
  add_wrenches(engine.set, engine.bodies, engine.shell, engine.acting);
  for (std::size_t i = 0; i < engine.pairs.size(); ++i) {
    kernels::WrenchParameters p{scene.k, scene.beta, {}, true};
    Vec6::Map(p.velocity) = exact.velocity(exact.pairs[i]);
    exact.spread(exact.pairs[i], kernels::contact_wrench_ref(fine.with(fine.depth, fine.weight), p,
                                                             scene.first[i + 1], scene.end[i + 1]));
  }
  Blocks K, D;
  for (int on = 0; on < kBodies; ++on)
    for (int by = 0; by < kBodies; ++by) K[on][by] = exact.K(on, by), D[on][by] = exact.D(on, by);
  for (int b = 0; b < kBodies; ++b)
    CHECK((engine.acting[b].f - exact.acting[b].f).norm() < 2e-5 * exact.acting[b].f.norm());
  check_blocks([&](int on, int by) { return engine.K(on, by); }, K, 2e-5);
  check_blocks([&](int on, int by) { return engine.D(on, by); }, D, 2e-5);
}

TEST_CASE("series: the exact gradients, between the fields too, are derivatives to 1e-8") {
  const Scene scene;
  const std::vector<double> rates = scene.rates(scene.at);
  // One solve for all contacts. `active` counts what carries load: a change of it is a kink.
  struct Loads {
    std::vector<double> kappa, slack, load;
    std::vector<bool> active;
  };
  const auto solve = [&](const State& s, const std::vector<double>& rate) {
    const Columns<double> c(scene, s);
    std::vector<double> e = c.depth;
    for (std::size_t i = 0; i < e.size(); ++i) e[i] -= scene.beta * rate[i];
    Loads out{e, e, e, {}};
    double y[6] = {};
    kernels::series_solve_ref<double>({c.n[0].data(), c.n[1].data(), c.n[2].data(), c.r[0].data(),
                                       c.r[1].data(), c.r[2].data(), e.data(), nullptr, e.size()},
                                      {scene.c, scene.lever, 1e-14, 40}, y, out.kappa.data(),
                                      out.slack.data());
    for (std::size_t i = 0; i < e.size(); ++i) {
      out.load[i] = out.kappa[i] * out.slack[i];
      out.active.push_back(out.load[i] > 0);
    }
    return out;
  };
  const Loads loads = solve(scene.at, rates);
  const auto active = std::count(loads.active.begin(), loads.active.end(), true);
  REQUIRE(active > 20);
  REQUIRE(active < static_cast<long>(loads.active.size()));  // some are left out

  const Columns<double> columns(scene, scene.at);
  Assembly engine(scene);
  for (std::size_t i = 0; i < engine.pairs.size(); ++i) {
    Pair& pair = engine.pairs[i];
    pair.sum = kernels::contact_wrench_ref(columns.with(loads.slack, loads.kappa),
                                           {1.0, 0.0, {}, true}, pair.begin, pair.end);
    spread_series(engine.set, sides_of(pair, engine.bodies, engine.acting), pair, pair.sum);
  }
  join_series(engine.set, engine.bodies, engine.shell, engine.acting);

  const Wrenches w = scene.wrenches(scene.at, loads.load);
  for (int b = 0; b < kBodies; ++b) CHECK((engine.acting[b].f - w[b]).norm() < 1e-12 * w[b].norm());
  const auto wrenches = [&](const State& s, const std::vector<double>& rate) {
    const Loads l = solve(s, rate);
    REQUIRE(l.active == loads.active);
    return scene.wrenches(s, l.load);
  };
  // Rates held: damping's own geometry is not in K.
  const Blocks K = differences(4e-7, 2e-5, [&](int body, const Vec6& dq) {
    return wrenches(Scene::moved(scene.at, body, dq), rates);
  });
  const Blocks D = differences(4e-4, 2e-2, [&](int body, const Vec6& du) {
    return wrenches(scene.at, scene.rates(Scene::faster(scene.at, body, du)));
  });
  check_blocks([&](int on, int by) { return engine.K(on, by); }, K, 1e-8);
  check_blocks([&](int on, int by) { return engine.D(on, by); }, D, 1e-8);
}

TEST_CASE(
    "the coupling's gradients are the derivatives of its wrench, below and above saturation, "
    "turned by up to 2.5 rad") {
  test::FieldArrays field = test::sample_analytic([](double, double, double z) { return z; },
                                                  {0, 0, -4 * mm}, mm, 1, 1, 1);
  test::ShellArrays shell = test::bottom_face(10 * mm, 8 * mm, 5 * mm, 5, 5);
  test::Model model({test::def_of(field)}, {shell.def()});
  struct Case {
    double angle, max_force, max_torque;
    bool cut;
  };
  for (const Case& at :
       {Case{0, 1e3, 1e3, false}, Case{0.15, 1e3, 1e3, false}, Case{1.5, 1e3, 1e3, false},
        Case{2.5, 1e3, 1e3, false}, Case{0.15, 5, 1e3, true}, Case{1.5, 1e3, 0.15, true},
        Case{2.5, 5, 0.15, true}, Case{2.5, 5, 1e3, true}}) {
    CAPTURE(at.angle);
    CAPTURE(at.max_force);
    CAPTURE(at.max_torque);
    std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    bodies[1].com = {1 * mm, -2 * mm, 0.5 * mm};
    h6HandDef hand = h6DefaultHandDef();
    hand.body = 1;
    hand.coupling.rotational_stiffness = 0.9;
    hand.coupling.max_force = at.max_force, hand.coupling.max_torque = at.max_torque;
    h6SessionDef def = h6DefaultSessionDef();
    def.gradient = H6_EXACT;
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
    h6Error error;
    h6Session* s = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(s, error.message);
    Hand& h = s->hands[0];
    h.seen = true;
    h.sample = test::hand_at(test::pose(30 * mm, 10 * mm, -20 * mm));
    const Quat q0 = exp_rotation({0.3, 0.7, -0.4});
    h.sample.pose.q = to(exp_rotation(at.angle * Vec3(0.5, -1, 0.7).normalized()) * q0);
    h.now = h.sample.pose;
    h.sample.velocity = {{0.01, 0.02, -0.01}, {0.2, 0.1, -0.3}};
    Body& body = s->bodies[1];
    body.q = q0, body.R = q0.toRotationMatrix();
    body.v = {0.02, -0.01, 0.03};
    body.w = {0.1, 0.2, 0.05};
    LinearWrench acting;
    acting.set_zero();
    h6Status status = 0;
    couple(s->settings, h, body, acting, status);
    CHECK(((status & H6_COUPLING_SATURATED) != 0) == at.cut);
    const Mat6 K = acting.K, D = acting.D;
    CHECK((acting.f - h.wrench).norm() == 0);
    const Body start = body;
    const auto wrench = [&](const Vec6& dq, const Vec6& du) -> Vec6 {
      body = start;
      body.x += dq.head<3>();
      body.q = exp_rotation(dq.tail<3>()) * body.q;
      body.R = body.q.toRotationMatrix();
      body.v += du.head<3>(), body.w += du.tail<3>();
      couple(s->settings, h, body, acting, status);
      return h.wrench;
    };
    Mat6 numeric_k, numeric_d;
    for (int i = 0; i < 6; ++i) {
      const Vec6 none = Vec6::Zero(), axis = Vec6::Unit(i);
      numeric_k.col(i) =
          derivative<Vec6>(i < 3 ? 1e-5 : 1e-3, [&](double d) { return wrench(d * axis, none); });
      numeric_d.col(i) =
          derivative<Vec6>(i < 3 ? 1e-3 : 1e-2, [&](double d) { return wrench(none, d * axis); });
    }
    for (int at = 0; at < 6; at += 3) {
      const auto close = [at](const Mat6& mine, const Mat6& numeric) {
        const Mat3 n = numeric.block<3, 3>(at, at);
        CHECK((mine.block<3, 3>(at, at) - n).norm() <= 1e-6 * n.norm());
      };
      close(K, numeric_k);
      close(D, numeric_d);
    }
    // Force and torque do not mix.
    CHECK(K.topRightCorner<3, 3>().norm() + K.bottomLeftCorner<3, 3>().norm() == 0);
    CHECK(numeric_k.topRightCorner<3, 3>().norm() + numeric_k.bottomLeftCorner<3, 3>().norm() <
          1e-6);
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
