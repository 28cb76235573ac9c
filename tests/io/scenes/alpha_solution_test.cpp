// SPDX-License-Identifier: Apache-2.0
// alpha_solution_test.cpp - the puzzle has a solution: the tests prove it on the geometry, then run
// the scene.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "io/scene/load_scene.h"
#include "io/scene/verdict.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"
#include "tests/io/private_cache.h"
#include "tests/support/near.h"
#include "tests/support/sanitized.h"

using namespace h6;
using namespace h6::io;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr std::uint32_t kSides = 12;
constexpr double kTick = 0.005;  // [s]

Scene solution() {
  Result<Scene> scene = make_scene("alpha-solution");
  REQUIRE_MESSAGE(scene, scene.error());
  return *scene;
}

// ---- a tube as a chain of straight pieces ------------------------------------------------------

// The centres of the mesh's rings. Every triangle joins two neighbouring rings or closes an end,
// and every vertex is within the tube's radius of its ring's centre. A point of the mesh is a mean
// of such vertices, so it is within the radius of the chain. The distance of two meshes is then at
// least the chains' distance less twice the radius. The first test checks these premises.
std::vector<h6Vec3> chain_of(const Mesh& mesh) {
  std::vector<h6Vec3> out(mesh.vertices.size() / kSides);
  for (std::uint32_t i = 0; i < out.size() * kSides; ++i)
    out[i / kSides] = out[i / kSides] + (1.0 / kSides) * mesh.vertices[i];
  return out;
}

// Distance of two segments. It is the minimum of a convex function on a square, which lies inside,
// where both slopes vanish, or on one of the four sides.
double segment_distance(const h6Vec3& a, const h6Vec3& b, const h6Vec3& c, const h6Vec3& d) {
  const auto to_point = [](const h6Vec3& p, const h6Vec3& from, const h6Vec3& to) {
    const h6Vec3 u = to - from;
    const double s = std::clamp(dot(p - from, u) / dot(u, u), 0.0, 1.0);
    return norm(from + s * u - p);
  };
  double best =
      std::min({to_point(a, c, d), to_point(b, c, d), to_point(c, a, b), to_point(d, a, b)});
  const h6Vec3 u = b - a, v = d - c, w = c - a, n = cross(u, v);
  const double nn = dot(n, n);
  if (nn > 0) {
    const double s = dot(cross(w, v), n) / nn, t = dot(cross(w, u), n) / nn;
    if (s > 0 && s < 1 && t > 0 && t < 1)
      best = std::min(best, std::abs(dot(w, n)) / std::sqrt(nn));
  }
  return best;
}

double chain_distance(const std::vector<h6Vec3>& a, const std::vector<h6Vec3>& b) {
  double best = 1;
  for (std::size_t i = 0; i + 1 < a.size(); ++i)
    for (std::size_t j = 0; j + 1 < b.size(); ++j)
      if (norm(a[i] - b[j]) - norm(a[i + 1] - a[i]) - norm(b[j + 1] - b[j]) < best)
        best = std::min(best, segment_distance(a[i], a[i + 1], b[j], b[j + 1]));
  return best;
}

std::vector<h6Vec3> placed(const h6Pose& pose, std::vector<h6Vec3> points) {
  for (h6Vec3& p : points) p = place(pose, p);
  return points;
}

// ---- linking -----------------------------------------------------------------------------------

const h6Pose kHere = {{0, 0, 0}, {1, 0, 0, 0}};

// The loop, closed by a segment across the gap; the segment is cut into pieces.
std::vector<h6Vec3> ring(const h6Pose& pose) {
  std::vector<h6Vec3> out;
  for (int i = 0; i <= 240; ++i) out.push_back(place(pose, alpha_point(-1 + i / 120.0)));
  for (int i = 1; i < 20; ++i)
    out.push_back(place(pose, (1 - i / 20.0) * alpha_point(1) + (i / 20.0) * alpha_point(-1)));
  return out;
}

// The linking number: Gauss's double integral over two closed polygons, evaluated at the edges'
// middles.
double gauss_linking(const std::vector<h6Vec3>& a, const std::vector<h6Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      const h6Vec3 &p = a[i], &q = a[(i + 1) % a.size()], &r = b[j], &s = b[(j + 1) % b.size()];
      const h6Vec3 apart = 0.5 * (p + q - r - s);
      sum += dot(apart, cross(q - p, s - r)) / std::pow(norm(apart), 3);
    }
  return sum / (4 * kPi);
}

struct SessionDeleter {
  void operator()(h6Session* session) const { h6DestroySession(session); }
};

}  // namespace

TEST_CASE("every point of an alpha is within the tube's radius of the chain of its ring centres") {
  const AlphaShape alpha = make_alpha();
  const std::vector<h6Vec3> chain = chain_of(alpha.mesh);
  const auto rings = static_cast<std::uint32_t>(chain.size());
  REQUIRE(alpha.mesh.vertices.size() == rings * kSides + 2);  // and the middles of both caps
  for (std::uint32_t i = 0; i < rings * kSides; ++i)
    REQUIRE(norm(alpha.mesh.vertices[i] - chain[i / kSides]) < alpha.tube_radius + 1e-8);
  const std::uint32_t caps[2] = {rings * kSides, rings * kSides + 1};
  CHECK(norm(alpha.mesh.vertices[caps[0]] - chain.front()) < 1e-8);
  CHECK(norm(alpha.mesh.vertices[caps[1]] - chain.back()) < 1e-8);
  for (const auto& triangle : alpha.mesh.triangles) {
    std::uint32_t low = rings, high = 0;
    for (const std::uint32_t v : triangle) {
      const std::uint32_t k = v == caps[0] ? 0 : v == caps[1] ? rings - 1 : v / kSides;
      low = std::min(low, k), high = std::max(high, k);
    }
    REQUIRE(high - low <= 1);
  }
}

TEST_CASE(
    "nothing is ever in the way: the tubes stay half a millimetre apart, between samples too") {
  const Scene scene = solution();
  const Mesh& mesh = *scene.bodies[0].field->mesh_data;
  const double radius = make_alpha().tube_radius;
  const std::vector<h6Vec3> chain = chain_of(mesh);
  double reach = 0;  // greatest distance of a point of the tool from its mesh frame's origin
  for (std::uint32_t i = 0; i < mesh.vertices.size(); ++i)
    reach = std::max(reach, norm(mesh.vertices[i]));
  const Path& path = scene.hands.front().path;
  double before = 0, tightest = 1;
  h6Pose last = path.front().pose;
  for (int i = 0; i * kTick <= path.back().t + kTick; ++i) {
    const h6Pose pose = sample_path(path, i * kTick);
    const double now = chain_distance(chain, placed(pose, chain)) - 2 * radius;
    tightest = std::min(tightest, now);
    // No point of the tool moved farther than this since the last tick. The clearance at each end
    // of the interval covers the half next to it.
    const double moved = norm(pose.p - last.p) + reach * norm(turn(last.q, pose.q));
    INFO("t = " << i * kTick << " s, clearance " << now / kMm << " mm");
    REQUIRE(now > 0.5 * kMm);
    if (i > 0) REQUIRE(before + now > moved + 0.1 * kMm);
    before = now, last = pose;
  }
  MESSAGE("least distance of the tubes: " << tightest / kMm << " mm");
}

TEST_CASE("the meshes' own distance, triangle by triangle, is no less than the tubes'" *
          doctest::skip(h6::test::kThreadSanitized)) {
  const Scene scene = solution();
  const Mesh& mesh = *scene.bodies[0].field->mesh_data;
  const std::vector<h6Vec3> chain = chain_of(mesh);
  const Path& path = scene.hands.front().path;
  double tightest = 1;
  for (double t = 0; t < path.back().t; t += 0.05) {
    const h6Pose pose = sample_path(path, t);
    if (norm(pose.p) > 30 * kMm) break;  // the alphas are apart; the chains' test is enough
    const double tubes = chain_distance(chain, placed(pose, chain)) - 2 * make_alpha().tube_radius;
    const double meshes = mesh_distance(mesh, moved(mesh, pose));
    INFO("t = " << t);
    REQUIRE(meshes > tubes - 1e-7);
    REQUIRE(meshes < tubes + 0.5 * kMm);  // 12-gons in circles: 0.14 mm a side, less at bends
    tightest = std::min(tightest, meshes);
  }
  MESSAGE("least distance of the meshes: " << tightest / kMm << " mm");
  CHECK(tightest > 0.5 * kMm);
}

TEST_CASE("hooked at the start, as the shortcut's alphas are, and not at the end") {
  const Path path = solution().hands.front().path;
  const auto links = [](const h6Pose& pose) {
    return std::abs(gauss_linking(ring(kHere), ring(pose)));
  };
  CHECK(links(path.front().pose) == h6::test::near(1).epsilon(0.02));
  CHECK(links(make_scene("alpha-shortcut")->bodies[1].pose) == h6::test::near(1).epsilon(0.02));
  CHECK(links(path.back().pose) < 0.02);
  CHECK(norm(path.back().pose.p) > 149 * kMm);
}

TEST_CASE("no point of the tool moves faster than 60 mm/s, and the hand's velocity never jumps" *
          doctest::skip(h6::test::kThreadSanitized)) {
  const Scene scene = solution();
  const Mesh& mesh = *scene.bodies[0].field->mesh_data;
  const Path& path = scene.hands.front().path;
  const auto velocity = [&](std::uint32_t v, double t) {
    const h6Velocity hand = sample_path_velocity(path, t);
    const h6Vec3 arm = rotate(sample_path(path, t).q, mesh.vertices[v]);
    return hand.linear + cross(hand.angular, arm);
  };
  double fastest = 0, jump = 0;
  for (std::size_t i = 1; i + 1 < path.size(); ++i)
    for (std::uint32_t v = 0; v < mesh.vertices.size(); v += 5) {
      const h6Vec3 here = velocity(v, path[i].t - 1e-4);
      fastest = std::max(fastest, norm(here));
      jump = std::max(jump, norm(velocity(v, path[i].t + 1e-4) - here));
    }
  CHECK(fastest < 60 * kMm);
  CHECK(jump < 6 * kMm);  // in 20 ms
}

TEST_CASE("the engine follows the way: the tool arrives, within one voxel of the hand throughout") {
  const Scene scene = solution();
  CHECK(scene.bodies[0].field->bake.voxels == 512);
  CHECK(scene.bodies[1].shell->bake.points == 25269);
  REQUIRE(scene.contact.method == H6_METHOD_FIRM);
  auto loaded = load_scene(scene);
  REQUIRE_MESSAGE(loaded, loaded.error());
  const LoadedScene& l = **loaded;
  double voxel = 0;
  for (const LoadedAsset& asset : l.assets) voxel = std::max(voxel, asset.voxel_size);
  const h6SessionDef def = l.session_def();
  h6Error error{};
  const std::unique_ptr<h6Session, SessionDeleter> session(
      h6CreateSession(l.model.get(), &def, &error));
  REQUIRE_MESSAGE(session, error.message);
  const int tool = l.body_index("tool");
  const Path& path = scene.hands.front().path;
  VerdictWatch watch(scene.verdict, l.watched_points(), l.bodies[1].com, scene.rate);
  double farthest = 0;
  std::uint32_t contacts = 0;
  const int frames = static_cast<int>(path.back().t * scene.rate);
  for (int i = 0; i < frames; ++i) {
    const double t = i / scene.rate;
    h6DeviceSample sample{};
    sample.pose = sample_path(path, t);
    sample.velocity = sample_path_velocity(path, t);
    h6Step(session.get(), &sample, nullptr);
    const h6FrameReport frame = h6GetFrame(session.get());
    const h6BodyState body = h6GetBody(session.get(), tool);
    contacts = std::max(contacts, static_cast<std::uint32_t>(frame.contacts));
    watch.frame(t, sample.pose, sample.velocity, body, frame.max_depth_voxels,
                (frame.status & H6_STATE_NOT_FINITE) == 0);
    for (std::size_t k = 0; k < l.watched_points().size(); k += 50)
      farthest = std::max(farthest, norm(place(body.pose, l.watched_points()[k]) -
                                         place(sample.pose, l.watched_points()[k])));
  }
  MESSAGE("the tool's points come no farther from the hand's than " << farthest / kMm << " mm");
  CHECK(contacts == 0);
  CHECK(farthest < voxel);
  CHECK(std::string(verdict_name(watch.verdict())) == "arrived");
}
