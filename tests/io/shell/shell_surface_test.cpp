// SPDX-License-Identifier: Apache-2.0
// A shell lies on the surface that the outside reaches, of sound meshes and of soups.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "io/file/mix.h"
#include "io/shell/bake_shell.h"
#include "io/shell/blue_noise.h"
#include "kernels/bake/triangle_distance.h"
#include "tests/io/shell/shell_test_meshes.h"
#include "tests/support/sanitized.h"

using namespace shells;
using h6::Result;
using h6::io::bake_field;
using h6::io::bake_shell;
using h6::io::FieldBake;
using h6::io::ShellBake;
using h6::io::ShellNormals;
using h6::io::ShellSurface;

namespace {

constexpr ShellSurface surfaces[] = {ShellSurface::automatic, ShellSurface::triangles,
                                     ShellSurface::field};

ShellBake with(std::size_t points, int voxels = 64,
               ShellSurface surface = ShellSurface::automatic) {
  ShellBake options;
  options.points = points;
  options.field.voxels = voxels;
  options.surface = surface;
  return options;
}

ShellData baked(const Mesh& mesh, const ShellBake& options,
                std::vector<std::string>* warnings = nullptr) {
  Result<ShellData> shell = bake_shell(mesh, options, warnings);
  REQUIRE_MESSAGE(shell, shell.error());
  REQUIRE((options.spacing > 0 || shell->size() == options.points));
  CHECK(std::string(broken_promise(*shell)) == "");
  CHECK(h6::io::check_shell(*shell));
  return *shell;
}

// Voxel and offset [m] of the field that the shell's options make.
struct Grid {
  double voxel, offset;
};
Grid grid_of(const Mesh& mesh, const ShellBake& options) {
  const auto field = bake_field(mesh, options.field, nullptr);
  REQUIRE(field);
  return {field->voxel_size, field->offset};
}

double distance_to(const Mesh& mesh, std::size_t t, const Vec3& p) {
  double corner[4][3] = {{p.x, p.y, p.z}};
  for (int k = 0; k < 3; ++k) {
    const Vec3& v = mesh.vertices[mesh.triangles[t][k]];
    corner[k + 1][0] = v.x, corner[k + 1][1] = v.y, corner[k + 1][2] = v.z;
  }
  return std::sqrt(h6::kernels::point_triangle_squared(corner[0], corner[1], corner[2], corner[3]));
}
double distance_to(const Mesh& mesh, const Vec3& p) {
  double least = INFINITY;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    least = std::min(least, distance_to(mesh, t, p));
  }
  return least;
}

void check_levels_are_blue(const ShellData& shell) {
  for (const std::size_t count : shell.level_points) {
    if (count < 2) continue;
    const Spacing s = spacing(shell, count);
    CAPTURE(count);
    CHECK(s.least / s.mean >= 0.6);
  }
}

Mesh without(Mesh mesh, const std::set<std::size_t>& gone) {
  Mesh out = mesh;
  out.triangles.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!gone.count(t)) out.triangles.push_back(mesh.triangles[t]);
  }
  return out;
}

Mesh sheet(double side) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {side, 0, 0}, {side, side, 0}, {0, side, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

Mesh turned_at_random(Mesh mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (h6::io::mix(7, t) & 1) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  }
  return mesh;
}

// Gives every triangle its own vertices and moves them by a hair, so that no edge is shared.
Mesh cracked(const Mesh& mesh, double hair) {
  Mesh out;
  std::uint64_t n = 0;
  const auto jitter = [&] { return hair * (double(h6::io::mix(3, n++) >> 11) * 0x1p-52 - 1); };
  for (const auto& t : mesh.triangles) {
    const auto first = std::uint32_t(out.vertices.size());
    for (const auto v : t) {
      const Vec3& p = mesh.vertices[v];
      out.vertices.push_back({p.x + jitter(), p.y + jitter(), p.z + jitter()});
    }
    out.triangles.push_back({first, first + 1, first + 2});
  }
  return out;
}

// Two boxes that overlap, and sheets through both, one of them twice.
Mesh messy() {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  add(mesh, inside_out(box({0.6, 0.6, 0.6}, {1.4, 1.4, 1.4})));
  Mesh wing = sheet(1.5);
  for (auto& v : wing.vertices) v = {v.x - 0.2, v.y - 0.2, 0.5};
  add(mesh, wing);
  add(mesh, inside_out(wing));
  return mesh;
}

}  // namespace

TEST_CASE("points of a soup lie where the distance to it is its field's offset") {
  const Mesh mesh = messy();
  const ShellBake options = with(4000, 64, ShellSurface::field);
  const ShellData shell = baked(mesh, options);
  const Grid grid = grid_of(mesh, options);
  REQUIRE(grid.offset > 0);
  double worst = 0, worst_source = 0;
  for (std::size_t i = 0; i < shell.size(); ++i) {
    const Vec3 p = point(shell, i);
    worst = std::max(worst, std::abs(distance_to(mesh, p) - grid.offset));
    worst_source =
        std::max(worst_source, std::abs(distance_to(mesh, shell.source[i], p) - grid.offset));
  }
  CHECK(worst < 0.05 * grid.voxel);
  CHECK(worst_source < 0.05 * grid.voxel);
  check_levels_are_blue(shell);
}

TEST_CASE("points of a soup lie on its triangles where that is asked for") {
  const Mesh mesh = messy();
  const ShellBake options = with(4000, 64, ShellSurface::triangles);
  const ShellData shell = baked(mesh, options);
  double worst = 0;
  for (std::size_t i = 0; i < shell.size(); ++i) {
    worst = std::max(worst, distance_to(mesh, shell.source[i], point(shell, i)));
  }
  CHECK(worst < 1e-6);
  check_levels_are_blue(shell);
}

TEST_CASE("what is hidden where parts overlap has no points, the rest has") {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  add(mesh, box({0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}));
  for (const ShellSurface surface : surfaces) {
    const ShellBake options = with(3000, 64, surface);
    const double voxel = grid_of(mesh, options).voxel;
    const ShellData shell = baked(mesh, options);
    double deepest = 0;
    std::size_t second = 0;
    for (std::size_t i = 0; i < shell.size(); ++i) {
      for (const double low : {0.0, 0.5}) {
        const Vec3 p = point(shell, i);
        deepest = std::max(deepest, std::min({p.x - low, p.y - low, p.z - low, low + 1 - p.x,
                                              low + 1 - p.y, low + 1 - p.z}));
      }
      second += shell.source[i] >= 12;
    }
    CHECK(deepest < 0.5 * voxel);
    CHECK(second > 1400);  // half of them, by symmetry
    CHECK(second < 1600);
  }
}

TEST_CASE("no point is on the inner wall of a tank, sound or with torn walls") {
  Mesh tank = sphere(1, 24);
  add(tank, inside_out(sphere(0.8, 24)));
  Mesh torn = turned_at_random(without(tank, {700, 2000}));  // holes far smaller than a voxel
  add(torn, without(sphere(0.5, 12), {40}));                 // and something loose in it
  for (const Mesh* mesh : {&tank, &torn}) {
    for (const ShellSurface surface : surfaces) {
      std::vector<std::string> warnings;
      const ShellData shell = baked(*mesh, with(2000, 32, surface), &warnings);
      double nearest = INFINITY, worst = 1;
      for (std::size_t i = 0; i < shell.size(); ++i) {
        const Vec3 p = point(shell, i);
        nearest = std::min(nearest, norm(p));
        worst = std::min(worst, -dot(p, normal(shell, i)) / norm(p));
      }
      CHECK(nearest > 0.97);
      CHECK(worst > 0.9);  // all of them inwards; facets and torn edges tilt some
      if (surface == ShellSurface::triangles) CHECK(warnings.size() >= 1);
    }
  }
}

TEST_CASE("normals are right within two degrees on spheres, cylinders and tori") {
  const auto on_sphere = [](const Vec3& p) { return p; };
  const auto on_torus = [](const Vec3& p) {
    const double r = std::hypot(p.x, p.y), s = 1 - 0.03 / r;
    return Vec3{p.x * s, p.y * s, p.z};
  };
  const auto on_cylinder = [](const Vec3& p) { return Vec3{p.x, p.y, 0}; };
  const Mesh tube = rolled(256, 2, [](std::uint32_t u, std::uint32_t v) {
    const double a = 2 * pi * u / 256;
    return Vec3{0.01 * std::cos(a), 0.01 * std::sin(a), v ? 0.02 : -0.02};
  });
  Mesh cylinder = tube;  // of the two rings of quads that `rolled` makes one runs back inside
  cylinder.triangles.resize(512);
  for (const double z : {-0.02, 0.02}) {
    const auto middle = std::uint32_t(cylinder.vertices.size());
    cylinder.vertices.push_back({0, 0, z});
    const std::uint32_t ring = z > 0 ? 256 : 0;
    for (std::uint32_t u = 0; u < 256; ++u) {
      const std::uint32_t a = ring + u, b = ring + (u + 1) % 256;
      cylinder.triangles.push_back(z > 0 ? std::array{a, b, middle} : std::array{b, a, middle});
    }
  }
  struct Shape {
    Mesh mesh;
    std::function<Vec3(const Vec3&)> out;
  };
  const Shape shapes[] = {{sphere(0.02, 96), on_sphere},
                          {torus(0.03, 0.01, 256, 128), on_torus},
                          {cylinder, on_cylinder}};
  for (const Shape& shape : shapes) {
    if (h6::test::kThreadSanitized && &shape != shapes) break;
    for (const ShellSurface surface : {ShellSurface::triangles, ShellSurface::field}) {
      for (const ShellNormals normals : {ShellNormals::triangles, ShellNormals::field}) {
        for (const double offset : {0.0, 1e-3}) {
          ShellBake options = with(3000, 64, surface);
          options.normals = normals;
          options.field.offset = offset;
          const double voxel = grid_of(shape.mesh, options).voxel;
          const ShellData shell = baked(shape.mesh, options);
          double worst = 1;
          std::size_t seen = 0;
          for (std::size_t i = 0; i < shell.size(); ++i) {
            const Vec3 p = point(shell, i), out = shape.out(p);
            if (&shape == &shapes[2] && std::abs(p.z) > 0.02 - 2 * voxel) continue;  // ends
            ++seen;
            worst = std::min(worst, -dot(out, normal(shell, i)) / norm(out));
          }
          CAPTURE(offset);
          CAPTURE(int(normals));
          CHECK(seen > 1500);
          CHECK(std::acos(worst) * 180 / pi < 2);
        }
      }
    }
  }
}

TEST_CASE("a sheet has points on both sides, with normals into it") {
  const Mesh mesh = sheet(0.1);
  for (const ShellSurface surface : surfaces) {
    const ShellBake options = with(2000, 128, surface);
    const ShellData shell = baked(mesh, options);
    std::size_t up = 0, down = 0, astray = 0;
    for (std::size_t i = 0; i < shell.size(); ++i) {
      up += shell.nz[i] < -0.9;  // above: the normal into the sheet points down
      down += shell.nz[i] > 0.9;
      astray += shell.nz[i] * shell.z[i] > 0;
    }
    CHECK(up > 800);
    CHECK(down > 800);
    CHECK(astray == 0);
    check_levels_are_blue(shell);
  }
}

TEST_CASE("cracks and T-junctions make no points within and none astray") {
  Mesh junction = box({0, 0, 0}, {1, 1, 1});
  const auto middle = std::uint32_t(junction.vertices.size());
  junction.vertices.push_back({0.5, 0, 0});  // on the edge from vertex 0 to vertex 1
  for (auto& t : junction.triangles) {       // one of the two faces at that edge is split there
    if (t != std::array<std::uint32_t, 3>{0, 1, 5}) continue;
    t = {0, middle, 5};
    junction.triangles.push_back({middle, 1, 5});
    break;
  }
  for (const Mesh& mesh : {junction, cracked(box({0, 0, 0}, {1, 1, 1}), 1e-4)}) {
    const ShellBake options = with(3000, 64, ShellSurface::field);
    const ShellData shell = baked(mesh, options);
    const Grid grid = grid_of(mesh, options);
    REQUIRE(grid.offset > 0);
    double nearest = INFINITY;
    for (std::size_t i = 0; i < shell.size(); ++i) {
      const Vec3 p = point(shell, i);
      const double out = std::max({-p.x, -p.y, -p.z, p.x - 1, p.y - 1, p.z - 1});
      CHECK(out > 0);
      CHECK(dot(Vec3{0.5, 0.5, 0.5} - p, normal(shell, i)) > 0);
      nearest = std::min(nearest, distance_to(mesh, p));
    }
    CHECK(nearest > grid.offset - 0.05 * grid.voxel);
  }
}

TEST_CASE("a spacing is kept between the points of a soup too") {
  ShellBake options = with(1);
  options.spacing = 0.02;
  const ShellData shell = baked(messy(), options);
  const Spacing s = spacing(shell, shell.size());
  CHECK(s.least >= 0.75 * 0.02 * (1 - 1e-4));  // opposite sides keep three quarters
  CHECK(s.mean < 1.4 * 0.02);
  CHECK(shell.size() > 8000);
}

TEST_CASE("any number of threads gives the same bits, of soups and of several parts") {
  Mesh parts = box({0, 0, 0}, {1, 1, 1});
  add(parts, box({0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}));
  for (const Mesh& mesh : {messy(), parts}) {
    for (const ShellSurface surface : surfaces) {
      ShellBake options = with(3000, 48, surface);
      options.threads = 1;
      const ShellData one = baked(mesh, options);
      for (const unsigned threads : {2u, 3u}) {
        options.threads = threads;
        CHECK(same_bits(one, baked(mesh, options)));
      }
    }
  }
}

TEST_CASE("meshes of nothing much make a shell or a sentence") {
  Mesh triangle;
  triangle.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.triangles = {{0, 1, 2}};
  Mesh wires = sheet(1);  // of no width
  for (std::uint32_t k = 0; k < 20; ++k) {
    wires.vertices.push_back({0.1 * k, 3, 0});
    wires.triangles.push_back({4 + k, 4 + k / 2, 4 + k});
  }
  Mesh twice = triangle;
  add(twice, inside_out(triangle));
  Mesh far = messy(), huge = messy(), tiny = messy(), speck = messy();
  for (auto& v : far.vertices) v = {v.x + 9e5, v.y - 9e5, v.z};
  for (auto& v : huge.vertices) v = {v.x * 6e5, v.y * 6e5, v.z * 6e5};
  for (auto& v : tiny.vertices) v = {v.x * 1e-7, v.y * 1e-7, v.z * 1e-7};
  speck.vertices.push_back({5e5, 0, 0});  // one triangle a long way off
  speck.vertices.push_back({5e5, 1e-3, 0});
  speck.vertices.push_back({5e5, 0, 1e-3});
  const auto n = std::uint32_t(speck.vertices.size());
  speck.triangles.push_back({n - 3, n - 2, n - 1});
  int made = 0;
  for (const Mesh& mesh : {triangle, wires, twice, far, huge, tiny, speck}) {
    for (const ShellSurface surface : surfaces) {
      for (const std::size_t points : {1, 500}) {
        if (h6::test::kThreadSanitized && (points == 1) == (surface == ShellSurface::field))
          continue;
        const auto shell = bake_shell(mesh, with(points, 64, surface), nullptr);
        made += bool(shell);
        if (shell) {
          CHECK(shell->size() == points);
          CHECK(std::string(broken_promise(*shell)) == "");
          CHECK(h6::io::check_shell(*shell));
        } else {
          CHECK(shell.error().size() > 20);
          CHECK(shell.error().back() == '.');
        }
      }
    }
  }
  CHECK(made >=
        h6::test::repeated(36, 18));  // only specks that the grid cannot hold may be refused
  for (const double bad : {double(NAN), double(INFINITY), 1e300, -1.1e6}) {
    Mesh broken = messy();
    broken.vertices[3].z = bad;
    const auto shell = bake_shell(broken, with(100), nullptr);
    REQUIRE_FALSE(shell);
    CHECK(shell.error().find("Vertex 3") == 0);
  }
}

TEST_CASE("a bake hears at every call that it shall stop, and calls no more") {
  Mesh parts = box({0, 0, 0}, {1, 1, 1});
  add(parts, box({0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}));
  for (const Mesh& mesh : {messy(), parts, box({0, 0, 0}, {1, 1, 1})}) {
    for (int last = 1;; last += h6::test::repeated(1, 6)) {
      int calls = 0;
      const auto shell =
          bake_shell(mesh, with(2000, 32), nullptr, [&](const std::string& what, double done) {
            CHECK(what.size() > 3);
            CHECK(done >= 0);
            CHECK(done <= 1);
            return ++calls < last;
          });
      if (shell) {  // the last call had come before
        CHECK(last > 3);
        break;
      }
      REQUIRE(shell.error() == "cancelled");
      REQUIRE(calls == last);
    }
  }
}
