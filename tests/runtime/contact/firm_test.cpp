// SPDX-License-Identifier: Apache-2.0
// `firm`: shares of stiffness on the Gauss map inside the series spring.
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"
#include "tests/support/near.h"

namespace {

constexpr double mm = 1e-3, kVoxel = mm, kLever = 20 * mm;
using Mat6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
using Vec3 = Eigen::Vector3d;

struct Rows {
  std::vector<float> n, g, r, d;
  void add(const Vec3& normal, const Vec3& arm, double depth) { add(normal, normal, arm, depth); }
  void add(const Vec3& normal, const Vec3& gradient, const Vec3& arm, double depth) {
    for (int axis = 0; axis < 3; ++axis) {
      n.push_back(static_cast<float>(normal[axis]));
      g.push_back(static_cast<float>(gradient[axis]));
      r.push_back(static_cast<float>(arm[axis]));
    }
    d.push_back(static_cast<float>(depth));
  }
  static Vec3 at(const std::vector<float>& column, std::size_t i) {
    return {column[3 * i], column[3 * i + 1], column[3 * i + 2]};
  }
  // After a small motion of the body through a field that stands still and is flat at each contact.
  Rows moved(const Vec3& v, const Vec3& w) const {
    Rows rows;
    for (std::size_t i = 0; i < d.size(); ++i) {
      const Vec3 normal = at(n, i), gradient = at(g, i), arm = at(r, i);
      rows.add(normal + w.cross(normal), gradient, arm + w.cross(arm),
               d[i] - gradient.dot(v + w.cross(arm)));
    }
    return rows;
  }
};

h6ContactDef firm() {
  h6ContactDef def = h6DefaultContactDef();
  def.method = H6_METHOD_FIRM;
  return def;
}

struct Answer {
  std::vector<float> weight;
  h6Wrench wrench{};
  Mat6 K, D;
  explicit Answer(const Rows& rows, const h6ContactDef& def = firm(),
                  h6Gradient form = H6_SYMMETRIC)
      : weight(rows.d.size()) {
    h6ContactArrays in{};
    in.form = form;
    in.count = rows.d.size();
    in.normals = rows.n.data(), in.gradients = rows.g.data(), in.arms = rows.r.data(),
    in.depths = rows.d.data();
    h6Error error{};
    const int code = h6WeighContacts(&def, &in, kVoxel, kLever, weight.data(), &wrench, K.data(),
                                     D.data(), &error);
    REQUIRE_MESSAGE(code == 0, error.message);
  }
};

double uniform(std::mt19937_64& random, double from, double to) {
  return from + (to - from) * std::ldexp(static_cast<double>(random() >> 11), -53);
}

Vec3 direction(std::mt19937_64& random) {
  const double z = uniform(random, -1, 1), a = uniform(random, 0, 6.283185307);
  const double q = std::sqrt(1 - z * z);
  return {q * std::cos(a), q * std::sin(a), z};
}

// Contacts about a few directions, some alike, some not yet touching.
Rows searched_set(std::mt19937_64& random) {
  Rows rows;
  const int bundles = 1 + static_cast<int>(random() % 6);
  for (int b = 0; b < bundles; ++b) {
    const Vec3 axis = direction(random), place = kLever * uniform(random, 0, 1) * direction(random);
    const double width = std::pow(10, uniform(random, -4, 0));
    const int contacts = 1 + static_cast<int>(random() % 20);
    for (int i = 0; i < contacts; ++i) {
      Vec3 arm = place + width * kLever * direction(random);
      if (arm.norm() > kLever) arm *= kLever / arm.norm();
      rows.add((axis + width * direction(random)).normalized(), arm,
               kVoxel * uniform(random, -0.5, 2));
    }
  }
  return rows;
}

// The eigenvalues of -K with torques and turns in units of the lever [k], in rising order.
Eigen::Matrix<double, 6, 1> net_stiffness(const Mat6& K) {
  Eigen::Matrix<double, 6, 1> unit;
  unit << 1, 1, 1, 1 / kLever, 1 / kLever, 1 / kLever;
  const Mat6 net = -1e-4 * unit.asDiagonal() * K * unit.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Mat6>(0.5 * (net + net.transpose())).eigenvalues();
}

// How the wrench really changes with the pose, by central differences; shares, directions and
// stiffness change too.
Mat6 true_derivative(const Rows& rows) {
  constexpr double kSmall = 2e-7;  // [m]
  Mat6 K;
  for (int k = 0; k < 6; ++k) {
    Vec3 v = Vec3::Zero(), w = v;
    (k < 3 ? v[k] : w[k - 3]) = k < 3 ? kSmall : kSmall / kLever;
    const h6Wrench a = Answer(rows.moved(-v, -w)).wrench, b = Answer(rows.moved(v, w)).wrench;
    const double way = 2 * (k < 3 ? kSmall : kSmall / kLever);
    K.col(k) << b.force.x - a.force.x, b.force.y - a.force.y, b.force.z - a.force.z,
        b.torque.x - a.torque.x, b.torque.y - a.torque.y, b.torque.z - a.torque.z;
    K.col(k) /= way;
  }
  return K;
}

// Gradients that lean from the normals by up to 40 degrees.
Rows leaning(const Rows& rows, std::mt19937_64& random) {
  Rows out;
  for (std::size_t i = 0; i < rows.d.size(); ++i) {
    const Vec3 n = Rows::at(rows.n, i), side = n.cross(direction(random)).normalized();
    const double angle = uniform(random, 0, 40 * 0.0174533);
    out.add(n, std::cos(angle) * n + std::sin(angle) * side, Rows::at(rows.r, i), rows.d[i]);
  }
  return out;
}

// HAPSIX_SEEDS=500 searches a million sets.
int searched_sets() {
  const char* const asked = std::getenv("HAPSIX_SEEDS");
  return 2000 * (asked ? std::atoi(asked) : 1);
}

// A disc of contacts that all push up.
Rows patch(int contacts, double radius, double depth) {
  Rows rows;
  for (int i = 0; i < contacts; ++i) {
    const double r = radius * std::sqrt((i + 0.5) / contacts), a = 2.39996 * i;
    rows.add({0, 0, 1}, {r * std::cos(a), r * std::sin(a), -5 * mm}, depth);
  }
  return rows;
}

}  // namespace

TEST_CASE("the net stiffness stays between 0 and c k, whatever the contacts") {
  std::mt19937_64 random(21);
  double most = 0;
  for (int set = 0; set < searched_sets(); ++set) {
    const auto net = net_stiffness(Answer(searched_set(random)).K);
    CHECK(net[0] >= -1e-6);
    CHECK(net[5] <= 4 * (1 + 1e-6));
    most = std::max(most, net[5]);
  }
  CHECK(most > 3.5);  // the search comes near the bound
}

TEST_CASE("the derivative of the force is bounded where gradients lean by up to 40 degrees") {
  std::mt19937_64 random(23);
  double held = 0, all = 0;
  for (int set = 0; set < searched_sets() / 4; ++set) {
    Rows rows = leaning(searched_set(random), random);
    for (float& depth : rows.d) depth *= 0.25f;  // to half a voxel
    const Answer answer(rows, firm(), H6_EXACT);
    held = std::max(held, net_stiffness(answer.K)[5]);
    all = std::max(all, net_stiffness(true_derivative(rows))[5]);
  }
  MESSAGE("largest eigenvalue [k]: shares held " << held << ", shares too " << all);
  CHECK(held <= 4 * 1.25);
  CHECK(all < 4 * 4);
}

TEST_CASE("no contact pulls") {
  std::mt19937_64 random(22);
  for (int set = 0; set < 500; ++set)
    for (const float weight : Answer(searched_set(random)).weight) CHECK(weight >= 0);
}

TEST_CASE("400 contacts at one place push as one does") {
  Rows one, many;
  one.add({0, 0, 1}, {mm, 0, -5 * mm}, 0.3 * mm);
  for (int i = 0; i < 400; ++i) many.add({0, 0, 1}, {mm, 0, -5 * mm}, 0.3 * mm);
  const Answer a(one), b(many);
  CHECK(b.wrench.force.z == h6::test::near(a.wrench.force.z).epsilon(1e-4));
  CHECK(b.wrench.torque.y == h6::test::near(a.wrench.torque.y).epsilon(1e-4));
  CHECK((a.K - b.K).norm() <= 1e-3 * a.K.norm());
}

TEST_CASE("a lone contact stiffens with depth, from 0 to more than k, and stays below c k") {
  double before = 0;
  for (const double depth : {0.001, 0.01, 0.05, 0.1, 0.2, 0.35, 0.5}) {
    Rows one;
    one.add({0, 0, 1}, {0, 0, -5 * mm}, depth * kVoxel);
    const double stiffness = Answer(one).wrench.force.z / (1e4 * depth * kVoxel);
    CHECK(stiffness > before);
    CHECK(stiffness < 4);
    CHECK((stiffness < 0.1) == (depth < 0.01));
    CHECK((stiffness > 1.5) == (depth >= 0.05));
    before = stiffness;
  }
}

TEST_CASE("a lone contact's load and derivative are those of METHOD's formula, in the touch too") {
  h6ContactDef def = firm();
  def.firmness = def.firmness_shallow = 4;
  const auto load = [&](double depth) {
    Rows one;
    one.add({0, 0, 1}, {0, 0, -5 * mm}, depth);
    return Answer(one, def, H6_EXACT);
  };
  const double touch = 0.03 * kVoxel, kappa = 4 / (1 - 1 / 4.0), small = 1e-3 * kVoxel;
  for (const double depth : {0.01 * kVoxel, 0.03 * kVoxel, 0.3 * kVoxel}) {
    CAPTURE(depth);
    const Answer at = load(depth);
    const double lambda = at.wrench.force.z / 1e4, slack = depth - lambda / 4;
    CHECK((slack < touch) == (depth < 0.1 * kVoxel));
    CHECK(lambda ==
          h6::test::near(kappa * (slack < touch ? slack * slack / (2 * touch) : slack - touch / 2))
              .epsilon(1e-4));
    const double slope =
        (load(depth + small).wrench.force.z - load(depth - small).wrench.force.z) / (2 * small);
    CHECK(-at.K(2, 2) == h6::test::near(slope).epsilon(1e-2));
  }
}

TEST_CASE("a patch a third of a voxel deep carries the force of half a voxel") {
  for (const int contacts : {1, 3, 30, 300, 3000}) {
    CAPTURE(contacts);
    CHECK(Answer(patch(contacts, 4 * mm, kVoxel / 3)).wrench.force.z > 0.5 * 1e4 * kVoxel);
  }
}

TEST_CASE("a point that enters the margin changes nothing") {
  Rows rows = patch(30, 4 * mm, 0.2 * mm);
  const Answer before(rows);
  rows.add({0, 0, 1}, {mm, mm, -5 * mm}, -0.5 * mm);
  const Answer after(rows);
  CHECK(after.weight.back() == 0);
  CHECK(after.wrench.force.z == h6::test::near(before.wrench.force.z).epsilon(1e-6));
  CHECK((after.K - before.K).norm() <= 1e-5 * before.K.norm());
}

namespace {

// A tool that its hand pushes down onto a floor at z = 0 with `force` [N]; returns how deep its tip
// is at the end [m].
double pushed_depth(h6::test::ShellArrays tool, h6Method method, double force) {
  h6::test::FieldArrays floor = h6::test::sample_analytic(
      [](double, double, double z) { return z; }, {-32 * mm, -32 * mm, -24 * mm}, mm, 8, 8, 8);
  h6::test::Model model({h6::test::def_of(floor)}, {tool.def()});
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0;
  bodies[1].shell = 0, bodies[1].pose = h6::test::pose(0.3 * mm, 0.2 * mm, 1 * mm);
  h6HandDef hand = h6DefaultHandDef();
  hand.body = 1;
  hand.coupling.max_force = force;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies.data(), def.body_count = 2;
  def.hands = &hand, def.hand_count = 1;
  def.contact.method = method;
  h6Error error{};
  h6Session* session = h6CreateSession(model.handle, &def, &error);
  REQUIRE_MESSAGE(session, error.message);
  for (int i = 0; i < 3000; ++i) {
    const double z = std::max(1 - 0.01 * i, -8.0) * mm;
    const h6DeviceSample sample = h6::test::hand_at(h6::test::pose(0.3 * mm, 0.2 * mm, z));
    h6Step(session, &sample, nullptr);
  }
  const double depth = -h6GetBody(session, 1).pose.p.z;
  h6DestroySession(session);
  return depth;
}

// A wedge whose edge lies along x at z = 0; its faces lean by `angle` from the vertical.
h6::test::ShellArrays knife_edge(double angle) {
  h6::test::ShellArrays s;
  for (const double side : {-1.0, 1.0})
    for (int i = -10; i <= 10; ++i)
      for (int j = 0; j <= 20; ++j)
        s.add(0.5 * mm * i, side * 0.5 * mm * j * std::sin(angle), 0.5 * mm * j * std::cos(angle),
              0, -side * std::cos(angle), std::sin(angle));
  return s;
}

// The side of a needle along z, with no point at its tip. Its normals may lean back from the tip by
// an angle, as those behind a barb do.
h6::test::ShellArrays needle(double radius, double back = 0) {
  h6::test::ShellArrays s;
  for (int ring = 0; ring <= 20; ++ring)
    for (int i = 0; i < 8; ++i) {
      const double a = 0.785398163 * i, x = std::cos(a), y = std::sin(a);
      s.add(radius * x, radius * y, 0.5 * mm * ring, -x * std::cos(back), -y * std::cos(back),
            -std::sin(back));
    }
  return s;
}

}  // namespace

TEST_CASE("a knife edge, a needle and a barb, which have no normal along a push, are held") {
  CHECK(pushed_depth(knife_edge(0.1), H6_METHOD_FIRM, 1.25) < 0.5 * mm);
  CHECK(pushed_depth(needle(0.15 * mm), H6_METHOD_FIRM, 1.25) < 0.5 * mm);
  CHECK(pushed_depth(needle(2 * mm, 0.35), H6_METHOD_FIRM, 1.25) < 0.5 * mm);
  CHECK(pushed_depth(needle(0.15 * mm), H6_METHOD_ROBUST, 1.25) > 2 * mm);
  // Along N an edge gives way by the angle of its faces.
  CHECK(pushed_depth(knife_edge(0.1), H6_METHOD_ROBUST, 1.25) >
        5 * pushed_depth(knife_edge(0.1), H6_METHOD_FIRM, 1.25));
}
