// SPDX-License-Identifier: Apache-2.0
// scenes_test.cpp - checks that the generated scenes are what they claim, without simulating them.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include "io/mesh/mesh.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"

using namespace h6;
using namespace h6::io;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kTube = 8 * kMm;  // thickness of the alphas

Scene scene_of(const std::string& name) {
  Result<Scene> scene = make_scene(name);
  REQUIRE_MESSAGE(scene, scene.error());
  return *scene;
}

// All scenes but the industrial ones, which have up to 1.8 million triangles and take a second each
// to make, and the machines. industrial_scenes_test.cpp and machines_test.cpp check those.
std::vector<SceneName> small_scenes() {
  static const std::set<std::string> others = {
      "bridge-and-dinosaur", "clip-and-rod",   "hose-in-bracket", "engine-bay",  "landing-gear",
      "alphas-in-two-hands", "piston-in-bore", "gear-train",      "nut-on-bolt", "wire-bundle",
      "spline-hub-1k",       "spline-hub-10k", "spline-hub-100k"};
  std::vector<SceneName> out;
  for (const SceneName& entry : scene_names())
    if (!others.count(entry.name)) out.push_back(entry);
  return out;
}

const SceneBody& body_of(const Scene& scene, const std::string& name) {
  for (const SceneBody& body : scene.bodies)
    if (body.name == name) return body;
  FAIL("no body " << name);
  return scene.bodies.front();
}

// Points of the body's shell in the mesh frame: those of its grid, or the vertices and triangle
// centres of its mesh.
std::vector<h6Vec3> shell_points(const SceneBody& body) {
  std::vector<h6Vec3> out;
  if (const auto& cloud = body.shell->points)
    for (std::size_t i = 0; i < cloud->x.size(); ++i)
      out.push_back({cloud->x[i], cloud->y[i], cloud->z[i]});
  if (const auto& mesh = body.shell->mesh_data) {
    for (std::uint32_t i = 0; i < mesh->vertices.size(); ++i) out.push_back(mesh->vertices[i]);
    for (const auto& t : mesh->triangles)
      out.push_back((1.0 / 3) *
                    (mesh->vertices[t[0]] + mesh->vertices[t[1]] + mesh->vertices[t[2]]));
  }
  return out;
}

bool inside(const Box& box, const h6Vec3& p) {
  return p.x >= box.low.x && p.x <= box.high.x && p.y >= box.low.y && p.y <= box.high.y &&
         p.z >= box.low.z && p.z <= box.high.z;
}

bool any_forbidden(const Scene& scene, const std::vector<h6Vec3>& points, const h6Pose& pose) {
  for (const h6Vec3& p : points)
    for (const Box& box : scene.verdict.forbidden)
      if (inside(box, pose.p + rotate(pose.q, p))) return true;
  return false;
}

// Winding number of the mesh around p: its solid angle in full spheres, 1 inside and 0 outside (van
// Oosterom, Strackee).
double winding(const Mesh& mesh, const h6Vec3& p) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const h6Vec3 a = mesh.vertices[t[0]] - p, b = mesh.vertices[t[1]] - p,
                 c = mesh.vertices[t[2]] - p;
    const double la = norm(a), lb = norm(b), lc = norm(c);
    sum += 2 * std::atan2(dot(a, cross(b, c)),
                          la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * kPi);
}

std::vector<h6Vec3> centre_line(double from, double to, int pieces, const h6Pose& pose) {
  std::vector<h6Vec3> out;
  for (int i = 0; i <= pieces; ++i)
    out.push_back(pose.p + rotate(pose.q, alpha_point(from + (to - from) * i / pieces)));
  return out;
}

double least_distance(const std::vector<h6Vec3>& a, const std::vector<h6Vec3>& b) {
  double best = 1e9;
  for (const h6Vec3& p : a)
    for (const h6Vec3& q : b) best = std::min(best, norm(p - q));
  return best;
}

const h6Pose kHere = {{0, 0, 0}, {1, 0, 0, 0}};

// The loop and the segment that closes it, as a closed polygon.
std::vector<h6Vec3> ring(const h6Pose& pose) { return centre_line(-1, 1, 300, pose); }

// Linking number of two closed polygons, from the signed solid angles of pairs of edges (Banchoff).
double linking(const std::vector<h6Vec3>& a, const std::vector<h6Vec3>& b) {
  double sum = 0;
  const auto angle = [](const h6Vec3& u, const h6Vec3& v, const h6Vec3& w) {
    const double lu = norm(u), lv = norm(v), lw = norm(w);
    return std::atan2(dot(u, cross(v, w)),
                      lu * lv * lw + dot(u, v) * lw + dot(v, w) * lu + dot(w, u) * lv);
  };
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      const h6Vec3 &p0 = a[i], &p1 = a[(i + 1) % a.size()], &q0 = b[j], &q1 = b[(j + 1) % b.size()];
      const h6Vec3 u = q0 - p0, v = q0 - p1, w = q1 - p1, x = q1 - p0;
      sum += 2 * (angle(u, v, w) + angle(w, x, u));
    }
  return sum / (4 * kPi);
}

}  // namespace

// ---- all of them -------------------------------------------------------------------------------

TEST_CASE("every listed scene can be made under its kebab-case name, and no other can") {
  std::set<std::string> names;
  for (const SceneName& entry : scene_names()) {
    CHECK(names.insert(entry.name).second);
    CHECK(entry.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-") ==
          std::string::npos);
    CHECK(!entry.about.empty());
    CHECK(entry.about.find('\n') == std::string::npos);
  }
  for (const SceneName& entry : small_scenes()) CHECK(scene_of(entry.name).name == entry.name);
  for (const char* needed :
       {"box-on-wall", "peg-in-hole", "alpha-shortcut", "engine-bay", "landing-gear"})
    CHECK(names.count(needed) == 1);
  const Result<Scene> unknown = make_scene("no-such-scene");
  REQUIRE(!unknown);
  CHECK(unknown.error().find("no-such-scene") != std::string::npos);
  CHECK(unknown.error().find("peg-in-hole") != std::string::npos);
}

TEST_CASE("obstacles are closed meshes wound outward") {
  for (const SceneName& entry : small_scenes())
    for (const SceneBody& body : scene_of(entry.name).bodies) {
      if (!body.field) continue;
      CAPTURE(entry.name + " " + body.name);
      const MeshAudit found = audit(*body.field->mesh_data);
      CHECK(found.closed);
      CHECK(found.duplicates == 0);
      CHECK(found.degenerate == 0);
      CHECK(found.flipped_edges == 0);
      CHECK(found.components == 1);
      CHECK(found.volume > 0);
    }
}

TEST_CASE("inward unit normals point into the solid that the grid stands on") {
  for (const char* name : {"box-on-wall", "peg-in-hole"}) {
    const Scene scene = scene_of(name);
    for (const SceneBody& body : scene.bodies) {
      if (!body.shell) continue;
      const PointCloud& c = *body.shell->points;
      REQUIRE(c.x.size() > 500);
      for (std::size_t i = 0; i < c.x.size(); ++i) {
        const h6Vec3 n = {c.nx[i], c.ny[i], c.nz[i]}, p = {c.x[i], c.y[i], c.z[i]};
        REQUIRE(std::abs(norm(n) - 1) < 1e-6);
        REQUIRE(dot(n, p) < -4.9e-3);  // both solids are convex, 5 mm thick or more around com
      }
    }
  }
}

TEST_CASE("every scene starts outside its obstacles and outside what is forbidden") {
  for (const SceneName& entry : small_scenes()) {
    const Scene scene = scene_of(entry.name);
    CAPTURE(entry.name);
    for (const SceneHand& hand : scene.hands) {
      const SceneBody& tool = body_of(scene, hand.body);
      const std::vector<h6Vec3> points = shell_points(tool);
      CHECK(!any_forbidden(scene, points, tool.pose));
      for (const SceneBody& body : scene.bodies) {
        if (!body.field || !body.fixed) continue;
        double most = 0;
        for (std::size_t i = 0; i < points.size(); i += 3)
          most = std::max(most, std::abs(winding(*body.field->mesh_data,
                                                 tool.pose.p + rotate(tool.pose.q, points[i]))));
        CHECK(most < 1e-6);
      }
    }
  }
}

TEST_CASE("the hand alone, without contact, goes into the forbidden region: each scene can fail") {
  for (const SceneName& entry : small_scenes()) {
    const Scene scene = scene_of(entry.name);
    CAPTURE(entry.name);
    if (scene.verdict.forbidden.empty()) continue;
    const SceneHand& hand = scene.hands.front();
    const std::vector<h6Vec3> points = shell_points(body_of(scene, hand.body));
    bool entered = false;
    for (const PathRow& row : hand.path)
      entered = entered || any_forbidden(scene, points, row.pose);
    CHECK(entered);
  }
}

TEST_CASE("hands start where their body is, never jump, and rest for 0.4 s at the end") {
  for (const SceneName& entry : small_scenes()) {
    const Scene scene = scene_of(entry.name);
    CAPTURE(entry.name);
    for (const SceneHand& hand : scene.hands) {
      const h6Pose start = body_of(scene, hand.body).pose, first = hand.path.front().pose;
      CHECK(norm(first.p - start.p) == 0);
      CHECK(hand.path.front().t == 0);
      for (std::size_t i = 1; i < hand.path.size(); ++i) {
        const PathRow &a = hand.path[i - 1], &b = hand.path[i];
        REQUIRE(b.t > a.t);
        const h6Quat& q = b.pose.q;
        REQUIRE(std::abs(std::hypot(std::hypot(q.w, q.x), std::hypot(q.y, q.z)) - 1) < 1e-12);
        REQUIRE(norm(b.pose.p - a.pose.p) <= 60 * kMm * (b.t - a.t));
        const h6Velocity v = sample_path_velocity(hand.path, (a.t + b.t) / 2);
        REQUIRE(norm(v.angular) < 6);
      }
      const double end = hand.path.back().t;
      CHECK(end < 8);
      const h6Velocity late = sample_path_velocity(hand.path, end - 0.4);
      CHECK(norm(late.linear) == 0);
      CHECK(norm(late.angular) < 1e-12);
    }
  }
}

TEST_CASE("distance between meshes is exact for boxes apart, and zero for boxes that cross") {
  const Mesh unit_box = box_mesh({0, 0, 0}, {1, 1, 1});
  const auto to = [&](h6Vec3 low, h6Vec3 high) {
    return mesh_distance(unit_box, box_mesh(low, high));
  };
  CHECK(to({2, 0.2, 0.2}, {3, 0.4, 0.4}) == h6::test::near(1));               // face to face
  CHECK(to({2, 3, 0.2}, {5, 5, 0.4}) == h6::test::near(std::sqrt(5.0)));      // edge to edge
  CHECK(to({2, 3, 4}, {5, 5, 5}) == h6::test::near(std::sqrt(1 + 4 + 9.0)));  // corner to corner
  CHECK(to({0.5, 0.4, 0.5}, {1.5, 0.6, 0.7}) == 0);
  CHECK(to({-1, 0.4, 0.45}, {2, 0.6, 0.55}) == 0);  // right through
}

// ---- one by one --------------------------------------------------------------------------------

TEST_CASE("box-on-wall starts 1 mm above the wall and is pressed 3 mm into it") {
  const Scene scene = scene_of("box-on-wall");
  double lowest = 1;
  for (const h6Vec3& p : shell_points(body_of(scene, "box"))) lowest = std::min(lowest, p.z);
  CHECK(lowest == h6::test::near(-5 * kMm));
  const SceneHand& hand = scene.hands.front();
  CHECK(hand.path.front().pose.p.z + lowest == h6::test::near(1 * kMm));
  CHECK(hand.path.back().pose.p.z + lowest == h6::test::near(-3 * kMm));
  CHECK(body_of(scene, "wall").field->bake.voxel_size == h6::test::near(1 * kMm));
}

TEST_CASE("peg-in-hole has Fig. 10's grid, clearance and depth") {
  const Scene scene = scene_of("peg-in-hole");
  const SceneBody& peg = body_of(scene, "peg");
  std::size_t side = 0, cap = 0;
  for (std::size_t i = 0; i < peg.shell->points->x.size(); ++i)
    ++(std::abs(peg.shell->points->nz[i]) > 0.5 ? cap : side);
  CHECK(side == 60 * 40);
  CHECK(cap == 21);  // grid points 4 mm apart within 10 mm
  // The hole is a prism around the circle, so its sides are never nearer than 10.3 mm and never
  // much farther.
  const Mesh& block = *body_of(scene, "block").field->mesh_data;
  double nearest = 1, farthest = 0, deepest = 0;
  for (const auto& t : block.triangles)
    for (int e = 0; e < 3; ++e) {
      const h6Vec3 middle = 0.5 * (block.vertices[t[e]] + block.vertices[t[(e + 1) % 3]]);
      const double r = std::hypot(middle.x, middle.y);
      if (middle.z > -29 * kMm && r < 12 * kMm)
        nearest = std::min(nearest, r), farthest = std::max(farthest, r);
      if (r < 6 * kMm && middle.z > -35 * kMm) deepest = std::min(deepest, middle.z);
    }
  CHECK(nearest == h6::test::near(10.3 * kMm).epsilon(1e-6));
  CHECK(farthest < 10.31 * kMm);
  CHECK(deepest == h6::test::near(-30 * kMm));
  const h6Pose end = scene.hands.front().path.back().pose, start = peg.pose;
  CHECK(end.p.x - start.p.x == h6::test::near(8 * kMm));
  CHECK(end.p.z - start.p.z == h6::test::near(-20 * kMm));
}

TEST_CASE("the alpha has exactly 1,008 triangles and lies on its tube") {
  const AlphaShape alpha = make_alpha();
  CHECK(alpha.mesh.triangles.size() == 1008);
  CHECK(2 * alpha.tube_radius == h6::test::near(kTube));
  const std::vector<h6Vec3> line = centre_line(-alpha_end(), alpha_end(), 4000, kHere);
  for (std::uint32_t i = 0; i < alpha.mesh.vertices.size(); ++i) {
    const double r = least_distance({alpha.mesh.vertices[i]}, line);
    REQUIRE(r < alpha.tube_radius * 1.001);
    const bool on_tube = r > alpha.tube_radius * 0.999, cap_centre = r < 1e-5;
    REQUIRE((on_tube || cap_centre));
  }
}

TEST_CASE("the alpha's gap is narrower than the tube at its thinnest, wide enough for the puzzle") {
  const AlphaShape alpha = make_alpha();
  // Without the mesh, the gap is the axes' distance less the thickness. The mesh's facets can only
  // make the gap wider.
  const double axes = least_distance(centre_line(0.7, alpha_end(), 3000, kHere),
                                     centre_line(-alpha_end(), -0.7, 3000, kHere));
  CHECK(alpha.gap >= axes - kTube - 1e-6);
  CHECK(alpha.gap <= axes - kTube + 2 * alpha.tube_radius * (1 - std::cos(kPi / 12)));
  const double thinnest = kTube * std::cos(kPi / 12);  // between opposite flats of the 12-gon
  CHECK(alpha.gap < thinnest - 1 * kMm);
  // When one gap passes through the other, the segments across the gaps cut each other at right
  // angles in their middles. Their ends, on the axes of the strands, are then axes / sqrt(2) apart.
  CHECK(axes / std::sqrt(2.0) > kTube + 1 * kMm);
  const Scene scene = scene_of("alpha-shortcut");
  char stated[32];
  std::snprintf(stated, sizeof stated, "%.2f mm", alpha.gap / kMm);
  CHECK(scene.about.find(stated) != std::string::npos);
}

TEST_CASE("alpha-shortcut has the paper's sizes") {
  const Scene scene = scene_of("alpha-shortcut");
  CHECK(body_of(scene, "static").field->bake.voxels == 512);
  const ShellBake& bake = body_of(scene, "tool").shell->bake;
  CHECK(bake.points == 25269);
  CHECK(bake.levels == 7);
}

TEST_CASE("the alphas start hooked together, a millimetre or more apart") {
  const Scene scene = scene_of("alpha-shortcut");
  const SceneBody &fixed = body_of(scene, "static"), &tool = body_of(scene, "tool");
  const double clearance =
      mesh_distance(*fixed.field->mesh_data, moved(*tool.shell->mesh_data, tool.pose));
  CHECK(clearance > 1 * kMm);
  const double axes = least_distance(centre_line(-alpha_end(), alpha_end(), 1500, kHere),
                                     centre_line(-alpha_end(), alpha_end(), 1500, tool.pose));
  CHECK(axes - kTube > 1 * kMm);
  CHECK(std::abs(linking(ring(kHere), ring(tool.pose))) == h6::test::near(1).epsilon(1e-6));
}

TEST_CASE("the hand's way unlinks the alphas and is blocked by nothing but the gap") {
  const Path path = scene_of("alpha-shortcut").hands.front().path;
  CHECK(std::abs(linking(ring(kHere), ring(path.back().pose))) < 1e-6);
  const std::vector<h6Vec3> still = centre_line(-alpha_end(), alpha_end(), 400, kHere);
  double tightest = 1;
  for (double t = 0; t < path.back().t; t += 0.02) {
    const h6Pose pose = sample_path(path, t);
    double distance = 1;
    h6Vec3 where{};
    for (const h6Vec3& p : centre_line(-alpha_end(), alpha_end(), 400, pose))
      for (const h6Vec3& q : still)
        if (norm(p - q) < distance) distance = norm(p - q), where = 0.5 * (p + q);
    tightest = std::min(tightest, distance);
    if (distance < kTube) {
      INFO("collides at t = " << t);
      REQUIRE(norm(where) < 12 * kMm);  // the gap is at the origin
    }
  }
  CHECK(tightest < kTube - 1 * kMm);  // it does collide
  CHECK(tightest > 6 * kMm);          // but tubes of 6 mm would pass
}

TEST_CASE(
    "no point of the tool can be in alpha-shortcut's forbidden box while the loops are linked") {
  const Scene scene = scene_of("alpha-shortcut");
  // While linked, the static ring meets the convex hull of the tool's ring. A point of the tool is
  // then no farther from the static ring than from the farthest point of the tool's own ring.
  double reach = 0;
  for (const h6Vec3& p : shell_points(body_of(scene, "tool")))
    for (const h6Vec3& q : ring(kHere)) reach = std::max(reach, norm(p - q));
  REQUIRE(scene.verdict.forbidden.size() == 1);
  const Box& box = scene.verdict.forbidden.front();
  for (const h6Vec3& p : ring(kHere)) {
    const auto outside = [](double x, double low, double high) {
      return std::max({low - x, x - high, 0.0});
    };
    const h6Vec3 gap = {outside(p.x, box.low.x, box.high.x), outside(p.y, box.low.y, box.high.y),
                        outside(p.z, box.low.z, box.high.z)};
    REQUIRE(norm(gap) > reach + 1 * kMm);
  }
  // At the hand's last pose much of the tool is in the box, so the verdict catches a method that
  // lets the tool through.
  const h6Pose end = scene.hands.front().path.back().pose;
  std::size_t in = 0;
  const std::vector<h6Vec3> points = shell_points(body_of(scene, "tool"));
  for (const h6Vec3& p : points) in += inside(box, end.p + rotate(end.q, p));
  CHECK(in * 4 > points.size());
}
