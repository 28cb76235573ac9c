// SPDX-License-Identifier: Apache-2.0
// alpha_pushes_test.cpp - the alpha pushed at its shortcut: the pushes differ as documented,
// "through" means unlinked for every direction, and the default method holds.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "io/scene/load_scene.h"
#include "io/scene/verdict.h"
#include "io/scenes/paper/alpha.h"
#include "io/scenes/paper/experiments.h"
#include "io/scenes/scenes.h"
#include "tests/support/near.h"
#include "tests/support/sanitized.h"

using namespace h6;
using namespace h6::io;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kPushes = 20;

// The loop, closed by a segment across the gap; the segment is cut into 20 pieces.
std::vector<h6Vec3> ring(const h6Pose& pose) {
  std::vector<h6Vec3> out;
  for (int i = 0; i <= 240; ++i)
    out.push_back(pose.p + rotate(pose.q, alpha_point(-1 + i / 120.0)));
  const h6Vec3 last = out.back(), first = out.front();
  for (int i = 1; i < 20; ++i) out.push_back((1 - i / 20.0) * last + (i / 20.0) * first);
  return out;
}

// The linking number: Gauss's double integral over two closed polygons, evaluated at the edges'
// middles.
double linking(const h6Pose& tool) {
  const std::vector<h6Vec3> a = ring({{0, 0, 0}, {1, 0, 0, 0}}), b = ring(tool);
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      const h6Vec3 &p = a[i], &q = a[(i + 1) % a.size()], &r = b[j], &s = b[(j + 1) % b.size()];
      const h6Vec3 apart = 0.5 * (p + q - r - s);
      sum += dot(apart, cross(q - p, s - r)) / std::pow(norm(apart), 3);
    }
  return std::abs(sum) / (4 * kPi);
}

struct Ended {
  Verdict verdict;
  h6Pose pose;
  double deepest = 0;
};

Ended pushed(const LoadedScene& loaded, int push, h6Method method) {
  const Path path = alpha_push(push);
  h6SessionDef def = loaded.session_def();
  def.contact.method = method;
  const std::unique_ptr<h6Session, decltype(&h6DestroySession)> session(
      h6CreateSession(loaded.model.get(), &def, nullptr), h6DestroySession);
  REQUIRE(session);
  const int tool = loaded.body_index("tool");
  VerdictWatch watch(loaded.scene.verdict, loaded.watched_points(),
                     loaded.bodies[static_cast<std::size_t>(tool)].com, loaded.scene.rate);
  Ended out{};
  for (int i = 0; i / loaded.scene.rate < path.back().t; ++i) {
    const double t = i / loaded.scene.rate;
    h6DeviceSample sample{};
    sample.pose = sample_path(path, t);
    sample.velocity = sample_path_velocity(path, t);
    h6Step(session.get(), &sample, nullptr);
    const h6FrameReport frame = h6GetFrame(session.get());
    const h6BodyState body = h6GetBody(session.get(), tool);
    watch.frame(t, sample.pose, sample.velocity, body, frame.max_depth_voxels,
                (frame.status & H6_STATE_NOT_FINITE) == 0);
    out.deepest = std::max(out.deepest, frame.max_depth_voxels);
    out.pose = body.pose;
  }
  out.verdict = watch.verdict();
  return out;
}

}  // namespace

TEST_CASE("pushes begin as the shortcut does and differ, each within 30 degrees of the strand") {
  const Scene shortcut = *make_scene("alpha-shortcut");
  std::vector<h6Vec3> ends;
  double widest = 0;
  for (int i = 0; i < kPushes; ++i) {
    const Path path = alpha_push(i), again = alpha_push(i);
    CHECK(norm(path.front().pose.p - shortcut.hands[0].path.front().pose.p) < 1e-12);
    REQUIRE(path.size() == again.size());
    CHECK(norm(path.back().pose.p - again.back().pose.p) == 0);
    // At the gap the hand stops moving slowly; from there it goes 250 mm.
    const h6Vec3 end = path.back().pose.p;
    h6Vec3 gap = path.front().pose.p;
    for (const PathRow& row : path)
      if (norm(row.pose.p - end) > 249 * kMm && norm(row.pose.p - end) < 251 * kMm)
        gap = row.pose.p;
    CHECK(norm(end - gap) == h6::test::near(250 * kMm).epsilon(1e-6));
    const double angle = std::acos(std::min(1.0, dot(unit(end - gap), alpha_outward())));
    CHECK(angle < kPi / 6 + 1e-6);
    widest = std::max(widest, angle);
    for (const h6Vec3& other : ends) CHECK(norm(end - other) > kMm);
    ends.push_back(end);
  }
  CHECK(widest > kPi / 9);
}

TEST_CASE("no point of the tool can be in a forbidden box while the loops are linked") {
  const Scene scene = alpha_pushes();
  // While linked, the static ring meets the convex hull of the tool's ring. A point of the tool is
  // then no farther from the static ring than from the farthest point of the tool's own ring.
  const AlphaShape alpha = make_alpha();
  const std::vector<h6Vec3> still = ring({{0, 0, 0}, {1, 0, 0, 0}});
  double reach = 0;
  for (const auto& v : alpha.mesh.vertices)
    for (const h6Vec3& q : still) reach = std::max(reach, norm(v - q));
  REQUIRE(scene.verdict.forbidden.size() == 7);
  for (const Box& box : scene.verdict.forbidden)
    for (const h6Vec3& p : still) {
      const auto outside = [](double x, double low, double high) {
        return std::max({low - x, x - high, 0.0});
      };
      REQUIRE(std::hypot(outside(p.x, box.low.x, box.high.x), outside(p.y, box.low.y, box.high.y),
                         outside(p.z, box.low.z, box.high.z)) > reach + 0.5 * kMm);
    }
}

TEST_CASE("robust lets no push through and stays linked; what global lets through is not") {
  auto loaded = load_scene(alpha_pushes());
  REQUIRE_MESSAGE(loaded, loaded.error());
  CHECK((*loaded)->scene.coupling.max_force == 20);
  CHECK(linking((*loaded)->scene.bodies[1].pose) == h6::test::near(1).epsilon(0.02));
  for (const int push : {0, 3, 7, 12, 18}) {
    if (h6::test::kThreadSanitized && push > 0) break;
    CAPTURE(push);
    const Ended held = pushed(**loaded, push, H6_METHOD_ROBUST);
    CHECK(held.verdict != Verdict::through);
    CHECK(held.verdict != Verdict::unstable);
    CHECK(linking(held.pose) == h6::test::near(1).epsilon(0.05));
    CHECK(held.deepest > 0.5);  // it was pushed
  }
  int through = 0;
  for (const int push : {0, 3, 7, 12}) {
    if (h6::test::kThreadSanitized && push > 0) break;
    const Ended ended = pushed(**loaded, push, H6_METHOD_GLOBAL);
    through += ended.verdict == Verdict::through;
    CHECK((linking(ended.pose) < 0.05) == (ended.verdict == Verdict::through));
  }
  if (!h6::test::kThreadSanitized) CHECK(through > 0);
}
