// SPDX-License-Identifier: Apache-2.0
// `firm` takes the error of trilinear interpolation out of its depths and gradients: METHOD.md,
// Sec. 3.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"

namespace {

constexpr double mm = 1e-3, kRadius = 12 * mm;
using Vec3 = Eigen::Vector3d;
using Quat = Eigen::Quaterniond;
using h6::test::FieldArrays;

double uniform(std::mt19937_64& random, double from, double to) {
  return from + (to - from) * std::ldexp(static_cast<double>(random() >> 11), -53);
}
Vec3 direction(std::mt19937_64& random) {
  const double z = uniform(random, -1, 1), a = uniform(random, 0, 6.283185307);
  return {std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a), z};
}
h6Pose to(const Vec3& p, const Quat& q) {
  return {{p[0], p[1], p[2]}, {q.w(), q.x(), q.y(), q.z()}};
}

// A ball about the origin with voxels of 1 mm.
FieldArrays ball() {
  return h6::test::sample_analytic(
      [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z) - kRadius; },
      {-16 * mm, -16 * mm, -16 * mm}, mm, 4, 4, 4);
}

// Finer samples in one cell of the first brick, where no contact comes.
struct Finer {
  std::vector<std::int32_t> refined, index = std::vector<std::int32_t>(512);
  std::vector<float> quarters = std::vector<float>(125, 2e-3f);
  void give(h6FieldDef& d) {
    refined.assign(d.brick_count, -1), refined[0] = 0, index[6] = -1;
    d.refined = refined.data(), d.fine_index = index.data(), d.refined_count = 1;
    d.quarters = quarters.data(), d.quarter_count = 1;
  }
};

// The largest errors of contacts against the ball, which turns and moves, in 200 seeded poses.
struct Errors {
  std::size_t contacts = 0;
  double depth = 0;  // [voxel]
  double lean = 0;   // of the gradient [rad]
};
Errors errors_of(h6Method method, bool refined) {
  FieldArrays arrays = ball();
  h6FieldDef field = h6::test::def_of(arrays);
  Finer finer;
  if (refined) finer.give(field);
  h6::test::ShellArrays tool = h6::test::bottom_face(2 * mm, 2 * mm, 3 * mm, 8, 8);
  h6::test::Model model({field}, {tool.def()});
  REQUIRE(model.handle);
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  bodies[0].fixed = true, bodies[0].field = 0, bodies[1].shell = 0;
  h6SessionDef def = h6DefaultSessionDef();
  def.bodies = bodies.data(), def.body_count = 2;
  def.contact.method = method, def.contact.fit = H6_FIT_TIGHT;
  h6Error error{};
  h6Session* session = h6CreateSession(model.handle, &def, &error);
  REQUIRE_MESSAGE(session, error.message);
  Errors out;
  std::mt19937_64 random(5);
  for (int i = 0; i < 200; ++i) {
    const Quat turn(Eigen::AngleAxisd(uniform(random, -3, 3), direction(random)));
    Vec3 up = direction(random), origin = 0.1 * direction(random);
    up[2] = std::fabs(up[2]);  // away from the first brick
    // The tool's bottom face lies about `up` on the ball, and its normals point out.
    const Quat stand = Quat::FromTwoVectors(Vec3::UnitZ(), up);
    const double lift = kRadius + 3 * mm - uniform(random, 0.2, 0.45) * mm;
    const h6BodyState a{to(origin, turn), {}},
        b{to(origin + turn * (lift * up), Quat(turn * stand)), {}};
    h6SetBody(session, 0, &a), h6SetBody(session, 1, &b);
    h6Step(session, nullptr, nullptr);
    const h6Contacts c = h6GetContacts(session, 1);
    for (std::size_t k = 0; k < c.count; ++k) {
      const Vec3 arm(c.rx[k], c.ry[k], c.rz[k]), g(c.gx[k], c.gy[k], c.gz[k]);
      const Vec3 place = turn.conjugate() * (turn * (lift * up) + arm);
      const double depth = kRadius - place.norm();
      if (depth < 0.11 * mm) continue;
      ++out.contacts;
      out.depth = std::max(out.depth, std::fabs(double{c.depth[k]} - depth) / mm);
      out.lean = std::max(out.lean, g.cross(turn * place.normalized()).norm());
    }
  }
  h6DestroySession(session);
  return out;
}

}  // namespace

TEST_CASE("depths and gradients of firm are nearer to a ball than the trilinear ones") {
  const Errors raw = errors_of(H6_METHOD_ROBUST, false), firm = errors_of(H6_METHOD_FIRM, false);
  CHECK(raw.contacts > 1000);
  CHECK(firm.contacts == raw.contacts);
  CHECK(raw.depth > 0.015);
  CHECK(raw.lean > 0.04);
  MESSAGE("depth " << raw.depth << " " << firm.depth << ", lean " << raw.lean << " " << firm.lean);
  CHECK(firm.depth < raw.depth / 4);
  CHECK(firm.lean < raw.lean / 4);
}

TEST_CASE("a field with finer samples keeps its depths under firm") {
  const Errors raw = errors_of(H6_METHOD_ROBUST, true), firm = errors_of(H6_METHOD_FIRM, true);
  CHECK(raw.contacts > 1000);
  CHECK(firm.contacts == raw.contacts);
  CHECK(firm.depth == raw.depth);
  CHECK(firm.lean == raw.lean);
}
