// SPDX-License-Identifier: Apache-2.0
// mesh_audit_test.cpp - the counts of the audit, on shapes of known answer and on real meshes.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "io/mesh/mesh.h"
#include "io/mesh/mesh_file.h"
#include "tests/io/mesh/mesh_samples.h"

using namespace h6::io;
using samples::append;
using samples::box;

namespace {

void is_clean(const MeshAudit& a) {
  CHECK(a.closed);
  CHECK(a.open_edges + a.nonmanifold_edges + a.odd_edges + a.flipped_edges == 0);
  CHECK(a.duplicates + a.degenerate == 0);
}

bool same_counts(const MeshAudit& a, const MeshAudit& b) {
  return a.triangles == b.triangles && a.vertices == b.vertices && a.duplicates == b.duplicates &&
         a.degenerate == b.degenerate && a.open_edges == b.open_edges &&
         a.nonmanifold_edges == b.nonmanifold_edges && a.odd_edges == b.odd_edges &&
         a.flipped_edges == b.flipped_edges && a.components == b.components && a.closed == b.closed;
}

// The same mesh with a vertex for every corner, as in an STL.
Mesh unwelded(const Mesh& mesh) {
  Mesh out;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    for (const auto v : t) out.vertices.push_back(mesh.vertices[v]);
    out.triangles.push_back({first, first + 1, first + 2});
  }
  return out;
}

// Edges with one and with more than two faces when duplicate triangles are NOT dropped.
std::pair<std::size_t, std::size_t> edges_with_duplicates(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> faces;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3 && std::set<std::uint32_t>(t.begin(), t.end()).size() == 3; ++i)
      ++faces[std::minmax({t[i], t[(i + 1) % 3]})];
  std::pair<std::size_t, std::size_t> open_and_more{};
  for (const auto& edge : faces) {
    open_and_more.first += edge.second == 1;
    open_and_more.second += edge.second > 2;
  }
  return open_and_more;
}

}  // namespace

TEST_CASE("a box is closed, whole, and as large as it is") {
  const MeshAudit a = audit(box({-1, 2, 3}, {1, 5, 3.5}));
  is_clean(a);
  CHECK(a.triangles == 12);
  CHECK(a.vertices == 8);
  CHECK(a.components == 1);
  CHECK(a.volume == h6::test::near(2 * 3 * 0.5));
  CHECK((a.low.x == -1 && a.low.y == 2 && a.low.z == 3));
  CHECK((a.high.x == 1 && a.high.y == 5 && a.high.z == 3.5));
}

TEST_CASE("an unwelded box, and one with idle vertices, are the same box") {
  Mesh idle = box();
  idle.vertices.push_back({100, 100, 100});
  CHECK(same_counts(audit(box()), audit(unwelded(box()))));
  CHECK(same_counts(audit(box()), audit(idle)));
  CHECK(audit(idle).high.x == 1);
}

TEST_CASE("a missing triangle opens three edges") {
  Mesh mesh = box();
  mesh.triangles.pop_back();
  const MeshAudit a = audit(mesh);
  CHECK(a.open_edges == 3);
  CHECK(a.odd_edges == 3);
  CHECK_FALSE(a.closed);
}

TEST_CASE("a mesh stored twice, either way round, is closed as ever") {
  for (const bool flip : {false, true}) {
    Mesh mesh = box();
    for (auto t : box().triangles) {
      if (flip) std::swap(t[0], t[2]);
      mesh.triangles.push_back({t[1], t[2], t[0]});
    }
    const MeshAudit a = audit(mesh);
    CHECK(a.duplicates == 12);
    CHECK(a.closed);
    CHECK(a.nonmanifold_edges == 0);
    CHECK(a.volume == h6::test::near(audit(box()).volume));
  }
}

TEST_CASE("a triangle stored three times does not open its edges") {
  Mesh mesh = box();
  mesh.triangles.push_back(mesh.triangles[4]);
  mesh.triangles.push_back(mesh.triangles[4]);
  CHECK(audit(mesh).duplicates == 2);
  CHECK(audit(mesh).closed);
}

TEST_CASE("a triangle wound the wrong way flips its edges and nothing else") {
  Mesh mesh = box();
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  const MeshAudit a = audit(mesh);
  CHECK(a.flipped_edges == 3);
  CHECK(a.closed);
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  CHECK(audit(mesh).flipped_edges == 3);
}

TEST_CASE("inside out, a volume is negative; far away, it is the same") {
  Mesh mesh = box();
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  CHECK(audit(mesh).volume == h6::test::near(-audit(box()).volume));
  const double size = 1e-3;
  CHECK(audit(box({9e5, -9e5, 9e5}, {9e5 + size, -9e5 + size, 9e5 + size})).volume ==
        h6::test::near(size * size * size).epsilon(1e-6));
}

TEST_CASE("boxes apart, at a corner and at an edge: components by vertices, edges by faces") {
  Mesh apart = box({0, 0, 0}, {1, 1, 1}), corner = apart, edge = apart;
  append(apart, box({2, 0, 0}, {3, 1, 1}));
  append(corner, box({1, 1, 1}, {2, 2, 2}));
  append(edge, box({1, 1, 0}, {2, 2, 1}));
  CHECK(audit(apart).components == 2);
  is_clean(audit(apart));
  CHECK(audit(corner).components == 1);
  is_clean(audit(corner));
  const MeshAudit a = audit(edge);
  CHECK(a.components == 1);
  CHECK(a.nonmanifold_edges == 1);
  CHECK(a.odd_edges == 0);
  CHECK(a.closed);
}

TEST_CASE("a fin on a box makes an edge of three faces, and the box is not closed") {
  Mesh mesh = box();
  mesh.vertices.push_back({0, 0, 7});
  mesh.triangles.push_back({4, 5, 8});
  const MeshAudit a = audit(mesh);
  CHECK(a.nonmanifold_edges == 1);
  CHECK(a.open_edges == 2);
  CHECK(a.odd_edges == 3);
  CHECK_FALSE(a.closed);
}

TEST_CASE("triangles without area are counted: collapsed ones have no edges, flat ones do") {
  Mesh mesh = box();
  mesh.triangles.push_back({0, 0, 7});
  mesh.triangles.push_back({3, 3, 3});
  MeshAudit a = audit(mesh);
  CHECK(a.degenerate == 2);
  CHECK(a.closed);
  CHECK(a.components == 1);

  // A side is split at its middle on one face only; a triangle without area closes the gap.
  mesh = box();
  mesh.vertices.push_back({0, -0.5, 0});  // between vertices 0 and 1
  const auto side = std::find(mesh.triangles.begin(), mesh.triangles.end(),
                              std::array<std::uint32_t, 3>{0, 2, 1});
  REQUIRE(side != mesh.triangles.end());
  *side = {0, 2, 8};
  mesh.triangles.push_back({8, 2, 1});
  CHECK_FALSE(audit(mesh).closed);
  mesh.triangles.push_back({0, 8, 1});
  a = audit(mesh);
  CHECK(a.degenerate == 1);
  is_clean([&] {
    auto b = a;
    b.degenerate = 0;
    return b;
  }());

  // A mesh of only such triangles is not closed.
  mesh.triangles = {{0, 0, 1}};
  CHECK_FALSE(audit(mesh).closed);
}

TEST_CASE("points of a line stay in line when scaled and far away; slivers keep their area") {
  for (const double scale : {1.0, 1e-3, 0.0254}) {
    Mesh mesh;
    for (const double s : {0.1, 0.7, 1.9})
      mesh.vertices.push_back({(1000 + 3 * s) * scale, (2 * s - 500) * scale, (7 - s) * scale});
    mesh.triangles = {{0, 1, 2}};
    CHECK(audit(mesh).degenerate == 1);
    mesh.vertices[1].z += 1e-9 * scale;
    CHECK(audit(mesh).degenerate == 0);
  }
}

TEST_CASE("nothing at all is not closed, and does not crash") {
  const MeshAudit a = audit(Mesh{});
  CHECK_FALSE(a.closed);
  CHECK(a.triangles + a.vertices + a.components == 0);
}

TEST_CASE("counts of random soups agree with maps, whatever the order of triangles and corners") {
  std::mt19937_64 random(7);
  for (int soup = 0; soup < 200; ++soup) {
    Mesh mesh;
    const unsigned points = 4 + random() % 9;
    for (unsigned i = 0; i < points; ++i)  // on a curve no three of whose points are in line
      mesh.vertices.push_back({double(i), double(i * i), double(i * i * i)});
    for (unsigned n = 1 + random() % 25; n > 0; --n)
      mesh.triangles.push_back({std::uint32_t(random() % points), std::uint32_t(random() % points),
                                std::uint32_t(random() % points)});

    std::set<std::set<std::uint32_t>> faces;
    std::size_t collapsed = 0, duplicates = 0;
    std::set<std::multiset<std::uint32_t>> seen;
    for (const auto& t : mesh.triangles) {
      if (!seen.insert({t.begin(), t.end()}).second) ++duplicates;
      if (const std::set<std::uint32_t> face(t.begin(), t.end()); face.size() == 3)
        faces.insert(face);
      else
        ++collapsed;
    }
    std::map<std::set<std::uint32_t>, int> edges;
    std::vector<std::set<std::uint32_t>> pieces;
    for (const auto& face : faces) {
      for (const std::uint32_t left_out : face) {
        std::set<std::uint32_t> edge = face;
        edge.erase(left_out);
        ++edges[edge];
      }
      std::set<std::uint32_t> piece = face;
      std::erase_if(pieces, [&](const auto& other) {
        const bool meet = std::any_of(other.begin(), other.end(),
                                      [&](std::uint32_t v) { return piece.contains(v); });
        if (meet) piece.insert(other.begin(), other.end());
        return meet;
      });
      pieces.push_back(piece);
    }
    const auto edges_with = [&](auto&& condition) {
      return std::size_t(std::count_if(edges.begin(), edges.end(),
                                       [&](const auto& e) { return condition(e.second); }));
    };
    const MeshAudit a = audit(mesh);
    CHECK(a.degenerate == collapsed);
    CHECK(a.duplicates == duplicates);
    CHECK(a.open_edges == edges_with([](int n) { return n == 1; }));
    CHECK(a.nonmanifold_edges == edges_with([](int n) { return n > 2; }));
    CHECK(a.odd_edges == edges_with([](int n) { return n % 2 == 1; }));
    CHECK(a.components == pieces.size());

    Mesh turned = mesh;  // winding of duplicates decides flipped edges: keep each one's cycle only
    for (auto& t : turned.triangles) std::rotate(t.begin(), t.begin() + random() % 3, t.end());
    CHECK(same_counts(audit(turned), a));
    for (std::size_t i = turned.triangles.size(); i > 1; --i)
      std::swap(turned.triangles[i - 1], turned.triangles[random() % i]);
    MeshAudit shuffled = audit(turned);
    shuffled.flipped_edges = a.flipped_edges;
    CHECK(same_counts(shuffled, a));
  }
}

TEST_CASE("real meshes: the counts known from elsewhere") {
  const char* folder = std::getenv("HAPSIX_TEST_DATA");
  if (!folder || !std::filesystem::exists(folder)) {
    MESSAGE("skipped: no real meshes");
    return;
  }
  struct Known {
    const char* file;
    std::size_t triangles, open, components;  // components 0: not known
  };
  // These counts come from other tools. None of the meshes has duplicates.
  static const Known kKnown[] = {
      {"nut-bolt/factory_nut_m16_loose_subdiv_3x.obj", 15080, 108, 0},
      {"nut-bolt/factory_bolt_m16_tight.obj", 25672, 0, 0},
      {"gears/factory_gear_base_loose_space_5e-4_subdiv_4x.obj", 9630, 68, 4},
      {"gears/factory_gear_medium_space_5e-4.obj", 35212, 0, 0},
      {"peg-hole/factory_round_peg_16mm_tight.obj", 1152, 0, 0},
      {"peg-hole/factory_round_hole_16mm_subdiv_3x.obj", 900, 36, 0},
      {"screw/screw-big.obj", 2828, 0, 0},
      {"screw/nut-big.obj", 2418, 0, 0},
      {"screw/anchor.obj", 8360, 0, 0},
      {"shells/hip_fe_module_shell_base.STL", 71970, 0, 0},
      {"shells/hip_fe_module_shell_cover.STL", 68710, 0, 0},
      {"ariac/insert_collision.stl", 3956, 0, 0},
      {"ariac/pump_base.stl", 1344, 0, 0},
      {"beams/0.obj", 7004, 0, 0},
      {"beams/6.obj", 24606, 0, 0},
      {"cad/counter.unitsmm.STL", 83750, 0, 6},
      {"cad/featuretype.STL", 3476, 576, 0},
      {"deformable/simpleBridge.obj", 32014, 0, 0},
      {"deformable/beam3_tet.obj", 412, 0, 0}};
  for (const Known& known : kKnown) {
    CAPTURE(known.file);
    const auto mesh = read_mesh(std::filesystem::path(folder) / known.file);
    REQUIRE_MESSAGE(mesh, mesh.error());
    const MeshAudit a = audit(*mesh);
    CHECK(a.triangles == known.triangles);
    CHECK(a.open_edges == known.open);
    CHECK(a.closed == (known.open == 0));
    CHECK(a.duplicates + a.nonmanifold_edges + a.flipped_edges == 0);
    if (known.components) CHECK(a.components == known.components);
  }

  // The soups. Other tools count edges with the duplicates kept. Dropping these opens edges that a
  // pair of equal faces had closed, so both counts are checked.
  struct Soup {
    const char* file;
    std::size_t triangles, duplicates, components, open, nonmanifold;  // 0: not known
    std::pair<std::size_t, std::size_t> with_duplicates;
  };
  static const Soup kSoups[] = {
      {"soups/robosim_chassis_new.stl", 42248, 4089, 0, 1003, 4223, {14, 6359}},
      {"soups/curiosity_chassis.obj", 32530, 5, 460, 3875, 80, {3875, 92}},
      {"soups/anymal_b_ref_pose.stl.gz", 377205, 1840, 260, 12641, 4886, {12241, 7446}}};
  for (const Soup& soup : kSoups) {
    CAPTURE(soup.file);
    const auto mesh = read_mesh(std::filesystem::path(folder) / soup.file);
    REQUIRE_MESSAGE(mesh, mesh.error());
    const MeshAudit a = audit(*mesh);
    CHECK(a.triangles == soup.triangles);
    CHECK(a.duplicates == soup.duplicates);
    if (soup.components) CHECK(a.components == soup.components);
    CHECK(a.open_edges == soup.open);
    CHECK(a.nonmanifold_edges == soup.nonmanifold);
    CHECK(edges_with_duplicates(*mesh) == soup.with_duplicates);
    CHECK_FALSE(a.closed);
  }
}
