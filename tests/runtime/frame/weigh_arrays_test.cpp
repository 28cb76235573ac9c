// SPDX-License-Identifier: Apache-2.0
// h6WeighContacts: the weights as a filter for any simulator.
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/kernels/kernel_test.h"
#include "tests/support/analytic.h"
#include "tests/support/near.h"

using namespace h6::test;

namespace {

constexpr double mm = 1e-3;
using Mat6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

struct Rows {
  std::vector<float> n, r, d, g;
  void add(const std::array<double, 3>& normal, const std::array<double, 3>& arm, double depth) {
    for (double v : normal) n.push_back(float(v));
    for (double v : arm) r.push_back(float(v));
    d.push_back(float(depth));
  }
  h6ContactArrays arrays() const {
    h6ContactArrays a{};
    a.count = d.size();
    a.normals = n.data(), a.arms = r.data(), a.depths = d.data();
    if (!g.empty()) a.gradients = g.data();
    return a;
  }
};

struct Answer {
  std::vector<float> weight;
  h6Wrench wrench{};
  Mat6 K, D;
  int code;
  h6Error error{};
  Answer(const h6ContactDef& def, const h6ContactArrays& a, double voxel = mm, double lever = 0.02)
      : weight(a.count, -1) {
    code =
        h6WeighContacts(&def, &a, voxel, lever, weight.data(), &wrench, K.data(), D.data(), &error);
  }
};

h6ContactDef method(int m, std::uint32_t pieces = 0) {
  h6ContactDef def = h6DefaultContactDef();
  def.method = static_cast<h6Method>(m);
  def.pieces = pieces;
  return def;
}

// A patch of a ball.
Rows cap(int n) {
  Rows rows;
  for (int i = 0; i < n; ++i) {
    const double z = -1 + 0.5 * (i + 0.5) / n, q = std::sqrt(1 - z * z), a = 2.39996 * i;
    const double x = q * std::cos(a), y = q * std::sin(a);
    rows.add({-x, -y, -z}, {0.01 * x, 0.01 * y, 0.01 * z}, 0.3 * mm * -z);
  }
  return rows;
}

}  // namespace

TEST_CASE("a lone contact keeps k in every method but `firm`: weight, wrench, stiffness, damping") {
  Rows one;
  one.add({0, 0, 1}, {3 * mm, 2 * mm, -5 * mm}, 0.25 * mm);
  for (int m = 0; m < H6_METHOD_COUNT; ++m) {
    if (m == H6_METHOD_FIRM) continue;  // stiffer than k: firm_test.cpp
    const Answer a(method(m), one.arrays());
    REQUIRE_MESSAGE(a.code == 0, a.error.message);
    CAPTURE(h6MethodName(static_cast<h6Method>(m)));
    CHECK(a.weight[0] == near(1).epsilon(1e-5));
    CHECK(a.wrench.force.z == near(1e4 * 0.25 * mm).epsilon(1e-5));
    CHECK(a.wrench.torque.x == near(2 * mm * 2.5).epsilon(1e-5));
    CHECK(a.wrench.torque.y == near(-3 * mm * 2.5).epsilon(1e-5));
    CHECK(a.K(2, 2) == near(-1e4).epsilon(1e-5));
    CHECK(a.K(3, 2) == near(-1e4 * 2 * mm).epsilon(1e-5));
    CHECK(a.D(2, 2) == near(-1e4 * 1e-3).epsilon(1e-5));
    CHECK((a.K - a.K.transpose()).norm() <= 1e-9 * a.K.norm());
  }
}

TEST_CASE("the filter weighs a session's contacts as the session does") {
  FieldArrays field = sample_analytic(
      [](double x, double y, double z) { return 20.2 * mm - std::sqrt(x * x + y * y + z * z); },
      {-32 * mm, -32 * mm, -32 * mm}, mm, 8, 8, 8);
  ShellArrays ball = sphere_points(20 * mm, 3000);
  Model model({def_of(field)}, {ball.def()});
  for (int m = 0; m < H6_METHOD_COUNT; ++m) {
    if (m == H6_METHOD_CLUSTER) continue;  // its rows are merged already
    if (m == H6_METHOD_FIRM) continue;     // a session leans on distances that arrays do not have
    std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0, bodies[1].pose = pose(0.9 * mm, 0, 0);
    h6SessionDef def = h6DefaultSessionDef();
    def.bodies = bodies.data(), def.body_count = 2;
    def.contact = method(m);
    def.contact.fit = H6_FIT_TIGHT;
    h6Session* s = h6CreateSession(model.handle, &def, nullptr);
    REQUIRE(s);
    h6Step(s, nullptr, nullptr);
    const h6Contacts c = h6GetContacts(s, 1);
    Rows rows;
    for (std::size_t i = 0; i < c.count; ++i) {
      rows.add({c.nx[i], c.ny[i], c.nz[i]}, {c.rx[i], c.ry[i], c.rz[i]}, c.depth[i]);
      for (float v : {c.gx[i], c.gy[i], c.gz[i]}) rows.g.push_back(v);
    }
    const Answer a(def.contact, rows.arrays(), mm, 20 * mm);
    REQUIRE_MESSAGE(a.code == 0, a.error.message);
    REQUIRE(c.count > 100);
    for (std::size_t i = 0; i < c.count; ++i) CHECK(a.weight[i] == near(c.weight[i]).epsilon(1e-3));
    h6DestroySession(s);
  }
}

namespace {

struct Rule {
  h6Method method;
  std::uint32_t pieces;
};
// Every rule, and every option of the Gauss ones.
constexpr Rule kRules[] = {{H6_METHOD_NONE, 0},
                           {H6_METHOD_GLOBAL, 0},
                           {H6_METHOD_CLUSTER, 0},
                           {H6_METHOD_GAUSS3, 0},
                           {H6_METHOD_GAUSS3, H6_PIECE_FACING | H6_PIECE_DEPTH},
                           {H6_METHOD_GAUSS3, H6_PIECE_PRINTED},
                           {H6_METHOD_GAUSS3, H6_PIECE_CLUSTER},
                           {H6_METHOD_GAUSS6, 0},
                           {H6_METHOD_GAUSS6, H6_PIECE_PRODUCT},
                           {H6_METHOD_GAUSS6, H6_PIECE_GEODESIC},
                           {H6_METHOD_GAUSS6, H6_PIECE_HANDLES},
                           {H6_METHOD_ROBUST, 0},
                           {H6_METHOD_ROBUST, H6_PIECE_CLUSTER},
                           {H6_METHOD_SERIES, 0}};

// A patch of a ball with neighbours near enough to cluster, and gradients that are not the normals.
// The origin is not the ball's own centre: there r is parallel to N, and a direction of r x N is
// rounding noise.
Rows crowded_cap() {
  std::mt19937_64 random(31);
  const auto uniform = [&] { return std::ldexp(static_cast<double>(random() >> 11), -52) - 1; };
  const Rows base = cap(120);
  Rows rows;
  for (std::size_t i = 0; i < 120; ++i)
    for (int twin = 0; twin < (i % 3 ? 1 : 2); ++twin) {
      const float *n = &base.n[3 * i], *r = &base.r[3 * i];
      rows.add({n[0], n[1], n[2]}, {r[0] + (3 + twin * 0.2) * mm, r[1] - 5 * mm, r[2] + 2 * mm},
               base.d[i] + twin * 0.03 * mm);
      Eigen::Vector3d g(n[0] + 0.9 * uniform(), n[1] + 0.9 * uniform(), n[2] + 0.9 * uniform());
      g.normalize();
      for (int a = 0; a < 3; ++a) rows.g.push_back(static_cast<float>(g[a]));
    }
  return rows;
}

h6ContactDef wide(const Rule& rule) {
  h6ContactDef def = method(rule.method, rule.pieces);
  def.epsilon = def.epsilon_normal = 0.3;  // so that neighbours see one another
  return def;
}

}  // namespace

TEST_CASE("weights of every method turn with the scene, and so do wrench and stiffness") {
  const Rows rows = crowded_cap();
  const Eigen::Matrix3d Q =
      Eigen::AngleAxisd(1.9, Eigen::Vector3d(0.4, -0.7, 0.6).normalized()).toRotationMatrix();
  const auto turned = [&](const std::vector<float>& v) {
    std::vector<float> out;
    for (std::size_t i = 0; i < v.size(); i += 3) {
      const Eigen::Vector3d w = Q * Eigen::Vector3d(v[i], v[i + 1], v[i + 2]);
      for (int a = 0; a < 3; ++a) out.push_back(static_cast<float>(w[a]));
    }
    return out;
  };
  const Rows other{turned(rows.n), turned(rows.r), rows.d, turned(rows.g)};
  for (const Rule& rule : kRules) {
    CAPTURE(std::string(h6MethodName(rule.method)));
    CAPTURE(rule.pieces);
    const Answer a(wide(rule), rows.arrays()), b(wide(rule), other.arrays());
    REQUIRE_MESSAGE(a.code == 0, a.error.message);
    REQUIRE(b.code == 0);
    float most = 0;
    for (float w : a.weight) most = std::max(most, w);
    REQUIRE(most > 0);
    for (std::size_t i = 0; i < rows.d.size(); ++i)
      CHECK(std::fabs(a.weight[i] - b.weight[i]) <= 1e-3f * most);
    const Eigen::Vector3d fa(a.wrench.force.x, a.wrench.force.y, a.wrench.force.z),
        fb(b.wrench.force.x, b.wrench.force.y, b.wrench.force.z);
    CHECK((Q * fa - fb).norm() <= 1e-3 * fa.norm());
    Mat6 R = Mat6::Zero();
    R.topLeftCorner<3, 3>() = R.bottomRightCorner<3, 3>() = Q;
    CHECK((R * a.K * R.transpose() - b.K).norm() <= 1e-3 * a.K.norm());
  }
}

TEST_CASE("weights of every method follow the points when these are put in another order") {
  const Rows rows = crowded_cap();
  const std::size_t n = rows.d.size();
  std::mt19937_64 random(8);
  std::vector<std::size_t> order(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = i;
  for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  Rows other;
  for (const std::size_t i : order) {
    const float *v = &rows.n[3 * i], *r = &rows.r[3 * i];
    other.add({v[0], v[1], v[2]}, {r[0], r[1], r[2]}, rows.d[i]);
    other.g.insert(other.g.end(), &rows.g[3 * i], &rows.g[3 * i] + 3);
  }
  for (const Rule& rule : kRules) {
    CAPTURE(std::string(h6MethodName(rule.method)));
    CAPTURE(rule.pieces);
    const Answer a(wide(rule), rows.arrays()), b(wide(rule), other.arrays());
    REQUIRE(a.code == 0);
    REQUIRE(b.code == 0);
    float most = 0;
    for (float w : a.weight) most = std::max(most, w);
    for (std::size_t i = 0; i < n; ++i)
      CHECK(std::fabs(b.weight[i] - a.weight[order[i]]) <= 1e-4f * most);
    CHECK(a.wrench.force.z == near(b.wrench.force.z).epsilon(1e-4));
    CHECK((a.K - b.K).norm() <= 1e-4 * a.K.norm());
  }
}

// About the ball's own centre r is parallel to N, and r x N is rounding noise, which a direction
// without a floor blows up to length 1: weights then depend on the processor.
TEST_CASE(
    "gauss6 with a torque length: where r is parallel to N, every SIMD target gives one share") {
  const Rows rows = cap(300);
  h6ContactDef def = method(H6_METHOD_GAUSS6);
  def.torque_length = mm;
  def.epsilon = 0.1;
  std::vector<double> want;  // 2 / phi, where all torque directions are 0
  for (std::size_t i = 0; i < 300; ++i) {
    double phi = 300;
    for (std::size_t j = 0; j < 300; ++j) {
      double gap2 = 0;
      for (int k = 0; k < 3; ++k)
        gap2 += std::pow(double{rows.n[3 * j + k]} - rows.n[3 * i + k], 2);
      phi += std::max(0.0, 1 - gap2 / (def.epsilon * def.epsilon));
    }
    want.push_back(2 / phi);
  }
  h6::kernels::test::on_every_target([&](const std::string&) {
    const Answer a(def, rows.arrays());
    REQUIRE(a.code == 0);
    for (std::size_t i = 0; i < 300; ++i) CHECK(a.weight[i] == near(want[i]).epsilon(1e-5));
  });
}

TEST_CASE("series: the stiffness that comes back is bounded by c k and pushes only") {
  for (const int n : {30, 3000}) {
    const Answer a(method(H6_METHOD_SERIES), cap(n).arrays(), mm, 0.02);
    REQUIRE(a.code == 0);
    Mat6 scaled = -a.K / 1e4;
    scaled.bottomRows<3>() /= 0.02;
    scaled.rightCols<3>() /= 0.02;
    const Eigen::SelfAdjointEigenSolver<Mat6> eigen(scaled);
    CHECK(eigen.eigenvalues()[5] <= 4 * (1 + 1e-9));
    CHECK(eigen.eigenvalues()[5] >= 1 - 1e-6);
    CHECK(eigen.eigenvalues()[0] >= -1e-6);
    CHECK((a.D - 1e-3 * a.K).norm() <= 1e-9 * a.D.norm());
    CHECK(a.wrench.force.z > 0);
  }
}

TEST_CASE("the exact form adds J_g and the turning of the arms") {
  Rows one;
  one.add({0, 0, 1}, {3 * mm, 2 * mm, -5 * mm}, 0.25 * mm);
  one.g = {0, 0.6f, 0.8f};
  for (const int m : {int(H6_METHOD_NONE), int(H6_METHOD_SERIES)}) {
    h6ContactArrays in = one.arrays();
    in.form = H6_EXACT;
    const Answer a(method(m), in);
    REQUIRE(a.code == 0);
    CHECK(a.K(2, 1) == near(-0.6e4).epsilon(1e-5));
    CHECK(a.K(2, 2) == near(-0.8e4).epsilon(1e-5));
    // -[F]x with F = (0, 0, 2.5 N): turning about x moves the force along -y.
    CHECK(a.K(1, 3) == near(-2.5).epsilon(1e-5));
    CHECK(a.K(0, 4) == near(2.5).epsilon(1e-5));
  }
}

TEST_CASE("damping takes from the force what the velocity says, and never makes it pull") {
  Rows one;
  one.add({0, 0, 1}, {0, 0, -5 * mm}, 0.25 * mm);
  for (int m = 0; m < H6_METHOD_COUNT; ++m) {
    if (m == H6_METHOD_FIRM) continue;  // stiffer than k: firm_test.cpp
    for (const double v : {-0.1, 0.1, 5.0}) {
      const h6Velocity velocity{{0, 0, v}, {0, 0, 0}};
      h6ContactArrays in = one.arrays();
      in.velocity = &velocity;
      const Answer a(method(m), in);
      REQUIRE(a.code == 0);
      CHECK(a.wrench.force.z == near(1e4 * std::max(0.0, 0.25 * mm - 1e-3 * v)).epsilon(1e-4));
    }
  }
}

TEST_CASE("contacts that do not touch have no weight; only the series rules read them") {
  Rows rows;
  rows.add({0, 0, 1}, {0, 0, -5 * mm}, 0.25 * mm);
  rows.add({0, 0, 1}, {mm, 0, -5 * mm}, -0.1 * mm);
  for (int m = 0; m < H6_METHOD_COUNT; ++m) {
    if (m == H6_METHOD_FIRM) continue;  // stiffer than k: firm_test.cpp
    const Answer a(method(m), rows.arrays());
    REQUIRE(a.code == 0);
    CHECK(a.weight[0] == near(1).epsilon(1e-5));
    CHECK(a.weight[1] == 0);
  }
}

TEST_CASE("a clustered contact has its share of its cluster's weight, by depth") {
  Rows rows;
  rows.add({0, 0, 1}, {0, 0, 0}, 0.1 * mm);
  rows.add({0, 1, 0}, {9 * mm, 0, 0}, 0.1 * mm);
  rows.add({0, 0, 1}, {0.2 * mm, 0, 0}, 0.3 * mm);
  const Answer a(method(H6_METHOD_CLUSTER), rows.arrays());
  REQUIRE(a.code == 0);
  CHECK(a.weight[0] == near(0.25).epsilon(1e-5));
  CHECK(a.weight[1] == near(1).epsilon(1e-5));
  CHECK(a.weight[2] == near(0.75).epsilon(1e-5));
  CHECK(a.wrench.force.z == near(1e4 * (0.01 + 0.09) / 0.4 * mm).epsilon(1e-5));
}

TEST_CASE("scratch of any alignment gives the same as the heap; too little is refused") {
  const Rows rows = cap(500);
  h6ContactArrays in = rows.arrays();
  std::vector<char> block(h6WeighScratchBytes(in.count) + 3);
  for (int m = 0; m < H6_METHOD_COUNT; ++m) {
    in.scratch = nullptr;
    const Answer heap(method(m), in);
    in.scratch = block.data() + 3, in.scratch_bytes = block.size() - 3;
    const Answer given(method(m), in);
    REQUIRE(given.code == 0);
    CHECK(std::memcmp(heap.weight.data(), given.weight.data(), 500 * sizeof(float)) == 0);
    CHECK(heap.K == given.K);
  }
  --in.scratch_bytes;
  const Answer refused(method(0), in);
  CHECK(refused.code == -1);
  CHECK(std::strstr(refused.error.message, "scratch") != nullptr);
}

TEST_CASE("twenty copies of each contact share the weight of one, in tens and thousands") {
  const Rows once = cap(100);
  Rows many;
  for (std::size_t i = 0; i < 2000; ++i) {
    const std::size_t k = i * 37 % 100;
    many.n.insert(many.n.end(), &once.n[3 * k], &once.n[3 * k] + 3);
    many.r.insert(many.r.end(), &once.r[3 * k], &once.r[3 * k] + 3);
    many.d.push_back(once.d[k]);
  }
  for (const h6ContactDef& def :
       {method(H6_METHOD_GAUSS3), method(H6_METHOD_GAUSS6), method(H6_METHOD_ROBUST),
        method(H6_METHOD_GAUSS6, H6_PIECE_PRODUCT | H6_PIECE_DEPTH | H6_PIECE_FACING)}) {
    const Answer few(def, once.arrays()), all(def, many.arrays());
    REQUIRE(few.code == 0);
    REQUIRE(all.code == 0);
    for (std::size_t i = 0; i < 2000; ++i)
      CHECK(all.weight[i] == near(few.weight[i * 37 % 100] / 20).epsilon(1e-5));
  }
}

TEST_CASE("no contacts give no wrench, every output may be left out, and wrong input is refused") {
  const Answer none(method(H6_METHOD_ROBUST), h6ContactArrays{});
  CHECK(none.code == 0);
  CHECK(none.K.norm() == 0);
  CHECK(none.wrench.force.z == 0);
  const Answer series(method(H6_METHOD_SERIES), h6ContactArrays{});
  CHECK(series.code == 0);
  CHECK(series.K.norm() == 0);

  Rows rows;
  rows.add({0, 0, 1}, {0, 0, -5 * mm}, 0.25 * mm);
  const h6ContactArrays in = rows.arrays();
  const h6ContactDef good = method(H6_METHOD_SERIES);
  CHECK(h6WeighContacts(&good, &in, mm, 0.02, nullptr, nullptr, nullptr, nullptr, nullptr) == 0);
  CHECK(h6WeighContacts(nullptr, &in, mm, 0.02, nullptr, nullptr, nullptr, nullptr, nullptr) == -1);
  CHECK(h6WeighContacts(&good, nullptr, mm, 1, nullptr, nullptr, nullptr, nullptr, nullptr) == -1);
  CHECK(Answer(good, in, 0).code == -1);
  CHECK(Answer(good, in, mm, NAN).code == -1);
  CHECK(Answer(good, in, mm, 1 * mm).code == -1);  // the arm is longer
  h6ContactDef bad = good;
  bad.series_c = 2;
  CHECK(Answer(bad, in).code == -1);
  for (const double wrong : {-1e4, static_cast<double>(NAN), HUGE_VAL}) {
    bad = good, bad.stiffness = wrong;
    CHECK(Answer(bad, in).code == -1);
  }
  for (double h6ContactDef::*width :
       {&h6ContactDef::epsilon, &h6ContactDef::epsilon_normal, &h6ContactDef::epsilon_torque})
    for (const double wrong : {0.0, -0.1, static_cast<double>(NAN)}) {
      bad = good, bad.*width = wrong;
      CHECK(Answer(bad, in).code == -1);
    }
  bad = good, bad.damping = -1e-3;
  CHECK(Answer(bad, in).code == -1);
  h6ContactArrays missing = in;
  missing.depths = nullptr;
  CHECK(Answer(good, missing).code == -1);
  for (const float wrong : {NAN, INFINITY, 2.0f}) {
    Rows broken = rows;
    broken.n[2] = wrong;
    CHECK(Answer(good, broken.arrays()).code == -1);
  }
  Rows broken = rows;
  broken.d[0] = NAN;
  CHECK(Answer(good, broken.arrays()).code == -1);
  const h6Velocity fast{{INFINITY, 0, 0}, {0, 0, 0}};
  h6ContactArrays moving = in;
  moving.velocity = &fast;
  CHECK(Answer(good, moving).code == -1);
}
