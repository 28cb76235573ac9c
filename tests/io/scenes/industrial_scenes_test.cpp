// SPDX-License-Identifier: Apache-2.0
// industrial_scenes_test.cpp - the generated industrial inputs: their sizes, their defects, and
// whether their recorded truth is true.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "io/mesh/mesh_file.h"
#include "io/scenes/industrial/forced_path.h"
#include "io/scenes/industrial/industrial.h"
#include "io/scenes/scenes.h"
#include "io/scenes/shapes.h"
#include "tests/io/scene/scene_samples.h"
#include "tests/support/sanitized.h"

using namespace h6;
using namespace h6::io;

namespace {

using Probe = IndustrialTruth::Probe;
using Corners = std::array<h6Vec3, 3>;

constexpr std::size_t kProbes = 300;
const IndustrialInput& bay() {
  static const IndustrialInput input = make_engine_bay(kProbes);
  return input;
}
const IndustrialInput& gear() {
  static const IndustrialInput input = make_landing_gear(kProbes);
  return input;
}

Corners corners(const Mesh& mesh, std::size_t t) {
  const auto& k = mesh.triangles[t];
  return {mesh.vertices[k[0]], mesh.vertices[k[1]], mesh.vertices[k[2]]};
}

bool same(const Mesh& a, const Mesh& b) {
  const auto equal = [](const auto& u, const auto& v) {
    return u.size() == v.size() && std::memcmp(u.data(), v.data(), u.size() * sizeof u[0]) == 0;
  };
  return equal(a.vertices, b.vertices) && equal(a.triangles, b.triangles) &&
         equal(a.part, b.part) && a.part_names == b.part_names;
}

void is_sane(const Mesh& mesh) {
  CHECK(mesh.part.size() == mesh.triangles.size());
  std::size_t bad = 0;
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) bad += v >= mesh.vertices.size();
  for (const std::int32_t p : mesh.part)
    bad += p < 0 || static_cast<std::size_t>(p) >= mesh.part_names.size();
  for (const Vec3& v : mesh.vertices)
    bad += !(std::abs(v.x) < 3) || !(std::abs(v.y) < 3) || !(std::abs(v.z) < 3);
  CHECK(bad == 0);
  for (const std::string& name : mesh.part_names) CHECK(!name.empty());
}

// The triangles of one part without duplicates of either winding.
std::vector<Corners> part_of(const Mesh& mesh, std::int32_t part) {
  std::map<std::array<std::uint32_t, 3>, std::size_t> once;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.part[t] != part) continue;
    auto key = mesh.triangles[t];
    std::sort(key.begin(), key.end());
    once.emplace(key, t);
  }
  std::vector<Corners> out;
  for (const auto& [key, t] : once) out.push_back(corners(mesh, t));
  return out;
}

double to_segment(const h6Vec3& p, const h6Vec3& a, const h6Vec3& b) {
  const h6Vec3 ab = b - a;
  const double s = std::clamp(dot(p - a, ab) / std::max(dot(ab, ab), 1e-300), 0.0, 1.0);
  return norm(p - a - s * ab);
}

double to_triangle(const h6Vec3& p, const Corners& t) {
  const h6Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  double edges = 1e9;
  bool over = norm(n) > 0;
  for (std::size_t k = 0; k < 3; ++k) {
    edges = std::min(edges, to_segment(p, t[k], t[(k + 1) % 3]));
    over = over && dot(cross(t[(k + 1) % 3] - t[k], p - t[k]), n) >= 0;
  }
  return over ? std::abs(dot(p - t[0], n)) / norm(n) : edges;
}

double to_all(const h6Vec3& p, const std::vector<Corners>& triangles) {
  double nearest = 1e9;
  for (const Corners& t : triangles) nearest = std::min(nearest, to_triangle(p, t));
  return nearest;
}

// How many triangles a ray from p crosses (Moeller, Trumbore).
int crossings(const h6Vec3& p, const h6Vec3& along, const std::vector<Corners>& triangles) {
  int count = 0;
  for (const Corners& t : triangles) {
    const h6Vec3 e = t[1] - t[0], f = t[2] - t[0], h = cross(along, f);
    const double det = dot(e, h);
    if (det == 0) continue;
    const h6Vec3 s = p - t[0], q = cross(s, e);
    const double u = dot(s, h) / det, v = dot(along, q) / det;
    count += u >= 0 && v >= 0 && u + v <= 1 && dot(f, q) / det > 0;
  }
  return count;
}

// The pieces of a part; triangles with a common vertex are in the same piece. Each piece is a solid
// by itself, and pieces may overlap.
std::vector<std::vector<Corners>> pieces_of(const Mesh& mesh, std::int32_t part) {
  std::map<std::uint32_t, std::uint32_t> above;
  const auto root = [&](std::uint32_t v) {
    while (above.try_emplace(v, v).first->second != v) v = above[v] = above[above[v]];
    return v;
  };
  std::map<std::array<std::uint32_t, 3>, std::size_t> once;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.part[t] != part) continue;
    auto key = mesh.triangles[t];
    std::sort(key.begin(), key.end());
    if (!once.emplace(key, t).second) continue;
    above[root(key[1])] = root(key[0]);
    above[root(key[2])] = root(key[0]);
  }
  std::map<std::uint32_t, std::vector<Corners>> found;
  for (const auto& [key, t] : once) found[root(key[0])].push_back(corners(mesh, t));
  std::vector<std::vector<Corners>> out;
  for (auto& [vertex, piece] : found) out.push_back(std::move(piece));
  return out;
}

// Tells whether p is inside at least one of the pieces, by the parity of most of five rays. A ray
// that passes through a missing triangle is outvoted.
bool inside_a_piece(const h6Vec3& p, const std::vector<std::vector<Corners>>& pieces) {
  for (const std::vector<Corners>& piece : pieces) {
    int votes = 0;
    for (const h6Vec3& along :
         {h6Vec3{0.8, 0.36, 0.479}, h6Vec3{-0.31, 0.77, -0.557}, h6Vec3{0.13, -0.62, 0.773},
          h6Vec3{-0.71, -0.42, -0.565}, h6Vec3{0.49, -0.05, -0.87}})
      votes += crossings(p, along, piece) % 2;
    if (votes >= 3) return true;
  }
  return false;
}

std::size_t part_count(const Mesh& mesh, const char* word) {
  std::size_t count = 0;
  for (const std::string& name : mesh.part_names) count += name.find(word) != std::string::npos;
  return count;
}

// The voxel of a bake with 1024 cells, 8 of them padding at either end.
double voxel_of(const MeshAudit& found) {
  return std::max(
             {found.high.x - found.low.x, found.high.y - found.low.y, found.high.z - found.low.z}) /
         (1024 - 16);
}

// Groups the probes by part, so that each part's triangles are gathered once.
std::map<std::int32_t, std::vector<Probe>> by_part(const std::vector<Probe>& probes) {
  std::map<std::int32_t, std::vector<Probe>> out;
  for (const Probe& probe : probes) out[probe.part].push_back(probe);
  return out;
}

void check_solids(const IndustrialInput& input, std::size_t most_triangles) {
  std::size_t judged = 0, inside = 0;
  for (const auto& [part, probes] : by_part(input.truth.inside)) {
    const auto pieces = pieces_of(input.mesh, part);
    std::size_t triangles = 0;
    for (const auto& piece : pieces) triangles += piece.size();
    if (triangles > most_triangles) continue;
    for (const Probe& probe : probes) {
      REQUIRE(probe.clearance > 1.19 * input.truth.voxel);
      ++judged;
      inside += inside_a_piece(probe.p, pieces);
    }
  }
  CHECK(judged > 50);
  CHECK(inside == judged);
}

// No triangle may be nearer than the claimed clearance. This does not check the path to the border;
// every cell on it makes the same claim.
void check_surroundings(const IndustrialInput& input) {
  const Mesh& mesh = input.mesh;
  REQUIRE(input.truth.outside.size() == kProbes);
  const std::size_t probes = 24;
  std::vector<double> nearest(probes, 1e9);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Corners c = corners(mesh, t);
    const double size = std::max(norm(c[1] - c[0]), norm(c[2] - c[0]));
    for (std::size_t i = 0; i < probes; ++i) {
      const h6Vec3& p = input.truth.outside[i].p;
      const h6Vec3 way = p - c[0];
      const double reach = nearest[i] + size;  // farther away it cannot be the nearest
      if (dot(way, way) < reach * reach) nearest[i] = std::min(nearest[i], to_triangle(p, c));
    }
  }
  for (std::size_t i = 0; i < probes; ++i) CHECK(nearest[i] >= input.truth.outside[i].clearance);
  for (const Probe& probe : input.truth.outside)
    CHECK(probe.clearance == h6::test::near(3 * input.truth.voxel).epsilon(0.02));
}

void check_sheets(const IndustrialInput& input) {
  CHECK(input.truth.sheets.size() > kProbes / 2);
  for (const auto& [part, probes] : by_part(input.truth.sheets)) {
    const std::vector<Corners> sheet = part_of(input.mesh, part);
    CAPTURE(input.mesh.part_names[static_cast<std::size_t>(part)]);
    CHECK(to_all(probes.front().p, sheet) < 1e-9);
    CHECK(probes.front().clearance > input.truth.voxel);
  }
}

void check_wires(const IndustrialInput& input, double voxel) {
  CHECK(input.truth.wires.size() > 40);
  for (std::size_t w = 0; w < input.truth.wires.size(); w += 9) {
    const IndustrialTruth::Wire& wire = input.truth.wires[w];
    CAPTURE(input.mesh.part_names[static_cast<std::size_t>(wire.part)]);
    const std::vector<Corners> skin = part_of(input.mesh, wire.part);
    CHECK(2 * wire.radius > 1.9 * voxel);
    CHECK(2 * wire.radius < 2.5 * voxel);
    // Except at the caps, the skin is about a radius away from the line. It is a little nearer on
    // its flats, and nearer still on the inner side of bends.
    for (std::size_t i = 1; i + 2 < wire.line.size(); i += 5) {
      const double r = to_all(0.5 * (wire.line[i] + wire.line[i + 1]), skin);
      CHECK(2 * r > 1.5 * voxel);
      CHECK(r <= wire.radius * (1 + 1e-9));
    }
  }
}

void check_holes(const IndustrialInput& input) {
  const IndustrialTruth& truth = input.truth;
  CHECK(truth.holes.size() >= 4);
  for (const IndustrialTruth::Hole& hole : truth.holes) {
    CAPTURE(input.mesh.part_names[static_cast<std::size_t>(hole.part)]);
    CHECK(hole.width > 2 * truth.voxel);
    CHECK(hole.width < 5 * truth.voxel);
    CHECK(norm(hole.normal) == h6::test::near(1));
    // The distance of the hole's middle from the remaining triangles is at most the radius of the
    // largest ball that passes.
    const std::vector<Corners> rest = part_of(input.mesh, hole.part);
    CHECK(2 * to_all(hole.centre, rest) > 0.5 * hole.width);
    CHECK(2 * to_all(hole.centre, rest) <= hole.width);
    CHECK(std::any_of(truth.behind_holes.begin(), truth.behind_holes.end(),
                      [&](const Probe& p) { return p.part == hole.part; }));
  }
  for (const auto& [part, probes] : by_part(truth.behind_holes)) {
    const auto pieces = pieces_of(input.mesh, part);
    std::size_t inside = 0;
    const std::size_t some = std::min<std::size_t>(probes.size(), 12);
    for (std::size_t i = 0; i < some; ++i) inside += inside_a_piece(probes[i].p, pieces);
    CAPTURE(input.mesh.part_names[static_cast<std::size_t>(part)]);
    CHECK(inside >= some * 9 / 10);  // a large hole can swallow three rays
  }
}

void check_defects(const IndustrialInput& input, const MeshAudit& found) {
  CHECK(!found.closed);
  CHECK(found.degenerate == 0);
  CHECK(found.duplicates >= input.truth.duplicates);
  CHECK(input.truth.duplicates > 500);
  CHECK(input.truth.duplicates < input.mesh.triangles.size() / 50);
  CHECK(input.truth.narrow_holes >= 40);
  CHECK(found.open_edges > 1000);     // sheets, holes
  CHECK(found.flipped_edges > 1000);  // mixed winding within a piece
  CHECK(found.components > 500);
  CHECK(input.truth.voxel == h6::test::near(voxel_of(found)).epsilon(1e-9));
}

}  // namespace

TEST_CASE("the engine bay has the paper's 505,276 triangles, in named parts, 0.9 m wide" *
          doctest::skip(h6::test::kThreadSanitized)) {
  const Mesh& mesh = bay().mesh;
  CHECK(mesh.triangles.size() == 505276);
  is_sane(mesh);
  CHECK(part_count(mesh, "wire") > 40);
  for (const char* word : {"bolt", "hose", "bracket", "rib", "tank", "fin", "nut", "firewall"})
    CHECK_MESSAGE(part_count(mesh, word) > 0, word);
  const MeshAudit found = audit(mesh);
  CHECK(found.high.x - found.low.x == h6::test::near(0.9).epsilon(0.01));
  check_defects(bay(), found);
  check_wires(bay(), voxel_of(found));
}

TEST_CASE("the landing gear has the paper's 1,789,551 triangles, in named parts, 2 m high" *
          doctest::skip(h6::test::kThreadSanitized)) {
  const Mesh& mesh = gear().mesh;
  CHECK(mesh.triangles.size() == 1789551);
  is_sane(mesh);
  for (const char* word :
       {"tyre", "brake", "torque link", "harness wire", "rivet", "door", "rib", "hydraulic"})
    CHECK_MESSAGE(part_count(mesh, word) > 0, word);
  const MeshAudit found = audit(mesh);
  CHECK(found.high.z - found.low.z == h6::test::near(2.0).epsilon(0.01));
  check_defects(gear(), found);
  check_wires(gear(), voxel_of(found));
}

TEST_CASE("the starter motor is closed, well wound, of 18,580 triangles") {
  const Mesh mesh = make_starter_motor();
  CHECK(mesh.triangles.size() == 18580);
  is_sane(mesh);
  const MeshAudit found = audit(mesh);
  CHECK(found.closed);
  CHECK(found.duplicates == 0);
  CHECK(found.degenerate == 0);
  CHECK(found.flipped_edges == 0);
  CHECK(found.volume > 0.8e-3);  // 0.8 litres and more
  CHECK(same(mesh, make_starter_motor()));
}

TEST_CASE("the actuator's 25,191 triangles are one there twice and a closed surface") {
  const Mesh mesh = make_actuator();
  CHECK(mesh.triangles.size() == 25191);
  is_sane(mesh);
  const MeshAudit found = audit(mesh);
  CHECK(found.duplicates == 1);
  CHECK(found.closed);
  CHECK(found.degenerate == 0);
  CHECK(found.flipped_edges == 0);
  CHECK(found.volume > 2e-3);
  CHECK(same(mesh, make_actuator()));
}

TEST_CASE("soups are the same every time, with probes and without" *
          doctest::skip(h6::test::kThreadSanitized)) {
  CHECK(same(bay().mesh, make_engine_bay().mesh));
  CHECK(same(gear().mesh, make_landing_gear().mesh));
  const IndustrialTruth again = make_engine_bay(kProbes).truth;
  REQUIRE(again.inside.size() == bay().truth.inside.size());
  for (std::size_t i = 0; i < again.inside.size(); ++i)
    CHECK(norm(again.inside[i].p - bay().truth.inside[i].p) == 0);
}

TEST_CASE("probes in solids are inside one of their part's pieces by parity" *
          doctest::skip(h6::test::kThreadSanitized)) {
  check_solids(bay(), 20000);
  check_solids(gear(), 20000);
}

TEST_CASE("probes outside are as far from every triangle as they say" *
          doctest::skip(h6::test::kThreadSanitized)) {
  check_surroundings(bay());
  check_surroundings(gear());
}

TEST_CASE("probes on sheets are on them, away from their edges" *
          doctest::skip(h6::test::kThreadSanitized)) {
  check_sheets(bay());
  check_sheets(gear());
}

TEST_CASE("recorded holes are open, as wide as recorded, and what is behind them is inside" *
          doctest::skip(h6::test::kThreadSanitized)) {
  check_holes(bay());
  check_holes(gear());
}

namespace {

// Distance of the part's corners and triangle centres from the soup's triangles, 12 mm at most.
double least_distance(const Mesh& soup, const Mesh& part) {
  constexpr double kCell = 12 * kMm;
  using Cell = std::array<int, 3>;
  const auto cell_of = [](const h6Vec3& p) {
    const auto number = [](double x) { return static_cast<int>(std::floor(x / kCell)); };
    return Cell{number(p.x), number(p.y), number(p.z)};
  };
  std::map<Cell, std::vector<h6Vec3>> cells;
  h6Vec3 low = part.vertices[0], high = low;
  for (std::size_t t = 0; t < part.triangles.size(); ++t) {
    const Corners c = corners(part, t);
    for (const h6Vec3& p : {c[0], (1.0 / 3) * (c[0] + c[1] + c[2])}) {
      cells[cell_of(p)].push_back(p);
      low = min(low, p);
      high = max(high, p);
    }
  }
  double nearest = kCell;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const Corners c = corners(soup, t);
    const auto beside = [&](auto axis) {
      return std::max({axis(c[0]), axis(c[1]), axis(c[2])}) < axis(low) - kCell ||
             std::min({axis(c[0]), axis(c[1]), axis(c[2])}) > axis(high) + kCell;
    };
    if (beside([](const h6Vec3& p) { return p.x; }) ||
        beside([](const h6Vec3& p) { return p.y; }) || beside([](const h6Vec3& p) { return p.z; }))
      continue;
    const Cell from = cell_of({std::min({c[0].x, c[1].x, c[2].x}) - nearest,
                               std::min({c[0].y, c[1].y, c[2].y}) - nearest,
                               std::min({c[0].z, c[1].z, c[2].z}) - nearest});
    const Cell to = cell_of({std::max({c[0].x, c[1].x, c[2].x}) + nearest,
                             std::max({c[0].y, c[1].y, c[2].y}) + nearest,
                             std::max({c[0].z, c[1].z, c[2].z}) + nearest});
    for (auto found = cells.lower_bound({from[0], from[1], from[2]});
         found != cells.end() && found->first[0] <= to[0]; ++found) {
      if (found->first[1] < from[1] || found->first[1] > to[1] || found->first[2] < from[2] ||
          found->first[2] > to[2])
        continue;
      for (const h6Vec3& p : found->second) nearest = std::min(nearest, to_triangle(p, c));
    }
  }
  return nearest;
}

}  // namespace

// ---- the scenes --------------------------------------------------------------------------------

TEST_CASE("the industrial scenes have the paper's sizes; their parts start and end clear of all" *
          doctest::skip(h6::test::kThreadSanitized)) {
  for (const auto& [name, points] : {std::pair{"engine-bay", 56823u}, {"landing-gear", 38148u}}) {
    CAPTURE(name);
    const Result<Scene> scene = make_scene(name);
    REQUIRE(scene);
    const SceneBody &soup = scene->bodies[0], &part = scene->bodies[1];
    CHECK(soup.fixed);
    CHECK(soup.field->bake.voxels == 1024);
    CHECK(part.shell->bake.points == points);
    CHECK(part.shell->bake.levels == 7);
    CHECK(scene->verdict.forbidden.empty());
    CHECK(!scene->verdict.target);

    const Path& path = scene->hands.front().path;
    CHECK(norm(path.front().pose.p - part.pose.p) == 0);
    CHECK(norm(path.back().pose.p - part.pose.p) < 1e-12);
    for (std::size_t i = 1; i < path.size(); ++i) {
      REQUIRE(path[i].t > path[i - 1].t);
      CHECK(norm(path[i].pose.p - path[i - 1].pose.p) <= 0.1001 * (path[i].t - path[i - 1].t));
    }
    // At the end of the way in, which is the tightest place, and at the start, the part's points
    // come near no triangle of the soup. After that the hand leads it through triangles.
    const Path way_in = std::string(name) == "engine-bay" ? starter_way_in() : actuator_way_in();
    const h6Pose tight = way_in.back().pose;
    for (const PathRow& row : way_in) CHECK(norm(sample_path(path, row.t).p - row.pose.p) < 1e-12);
    CHECK(norm(tight.p - part.pose.p) > 0.15);
    const double voxel = (std::string(name) == "engine-bay" ? bay() : gear()).truth.voxel;
    CHECK(least_distance(*soup.field->mesh_data, moved(*part.shell->mesh_data, tight)) > 2 * voxel);
    CHECK(least_distance(*soup.field->mesh_data, moved(*part.shell->mesh_data, part.pose)) >
          5 * voxel);
    std::size_t forced = 0;  // stations at which the hand alone would be in the way of something
    for (const PathRow& row : path)
      forced += row.t > way_in.back().t &&
                least_distance(*soup.field->mesh_data, moved(*part.shell->mesh_data, row.pose)) <
                    0.5 * voxel;
    CHECK(forced >= 3);
  }
}

TEST_CASE("forced paths begin on the way in and are the same every time") {
  const Path way_in = starter_way_in();
  const Path a = forced_path(way_in, 7), b = forced_path(way_in, 7), c = forced_path(way_in, 8);
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK(norm(a[i].pose.p - b[i].pose.p) == 0);
    CHECK(a[i].t == b[i].t);
  }
  CHECK(norm(a.front().pose.p - way_in.front().pose.p) == 0);
  CHECK(norm(a.back().pose.p - c.back().pose.p) > 1e-3);
}

TEST_CASE("an industrial scene is exported as plain files and read back" *
          doctest::skip(h6::test::kThreadSanitized)) {
  const Folder folder;
  const Scene made = *make_scene("engine-bay");
  REQUIRE(export_scene(made, folder.path / "out"));
  const Result<Scene> back = read_scene(folder.path / "out" / "scene.json");
  REQUIRE_MESSAGE(back, back.error());
  check_same(made, *back);
  const Result<Mesh> mesh = read_mesh(back->bodies[0].field->mesh, back->unit);
  REQUIRE_MESSAGE(mesh, mesh.error());
  CHECK(mesh->triangles.size() == 505276);
  const MeshAudit x = audit(bay().mesh), y = audit(*mesh);
  // Single precision may merge two corners, so the counts are nearly but not exactly the same.
  CHECK(std::abs(static_cast<double>(x.open_edges) - static_cast<double>(y.open_edges)) <
        0.01 * x.open_edges);
  const Result<Mesh> part = read_mesh(back->bodies[1].shell->mesh, back->unit);
  REQUIRE_MESSAGE(part, part.error());
  CHECK(part->triangles.size() == 18580);
  CHECK(audit(*part).closed);
}
