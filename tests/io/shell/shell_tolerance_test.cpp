// SPDX-License-Identifier: Apache-2.0
// Shells baked to a tolerance: what a flat obstacle can miss between points, edges and corners, and
// how far any place of the surface is from a point.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "io/shell/bake_shell.h"
#include "tests/io/shell/shell_test_meshes.h"

using namespace shells;
using h6::io::bake_shell;
using h6::io::ShellBake;
using h6::io::ShellSurface;

namespace {

ShellData baked_to(const Mesh& mesh, double tolerance, double spacing = 0, unsigned threads = 0) {
  ShellBake options;
  options.tolerance = tolerance;
  options.spacing = spacing;
  options.threads = threads;
  auto shell = bake_shell(mesh, options, nullptr);
  REQUIRE_MESSAGE(shell, shell.error());
  REQUIRE(std::string(broken_promise(*shell)) == "");
  return *shell;
}

// Points of a shell near a place, in cells of a grid.
class Near {
 public:
  Near(const ShellData& shell, double reach) : shell_(shell), reach_(reach) {
    for (std::uint32_t i = 0; i < shell.size(); ++i) order_.push_back(i);
    std::sort(order_.begin(), order_.end(),
              [&](auto a, auto b) { return shell.x[a] < shell.x[b]; });
  }
  // The nearest point, and by how much the place stands out beyond the points within reach, at
  // least.
  struct Found {
    double distance = std::numeric_limits<double>::infinity(), missed = distance;
  };
  Found operator()(const Vec3& p, const Vec3& outward) const {
    Found found;
    const auto from = std::lower_bound(order_.begin(), order_.end(), p.x - reach_,
                                       [&](auto i, double x) { return shell_.x[i] < x; });
    for (auto i = from; i != order_.end() && shell_.x[*i] < p.x + reach_; ++i) {
      const Vec3 way = p - point(shell_, *i);
      const double d = norm(way);
      found.distance = std::min(found.distance, d);
      if (d < reach_) found.missed = std::min(found.missed, dot(way, outward));
    }
    return found;
  }

 private:
  const ShellData& shell_;
  double reach_;
  std::vector<std::uint32_t> order_;
};

struct Worst {
  double distance = 0, missed = 0;
};
// At random places of the surface, and at random normals between those of the faces at its edges.
Worst worst_of(const ShellData& shell, const Mesh& mesh, double spacing, int places) {
  const Near near(shell, 1.25 * spacing);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> sum;
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    sum.push_back(area += norm(cross(b - a, c - a)));
  }
  Worst worst;
  for (int i = 0; i < places; ++i) {
    const std::size_t t =
        std::size_t(std::upper_bound(sum.begin(), sum.end(), area * unit(random)) - sum.begin());
    const auto& f = mesh.triangles[std::min(t, sum.size() - 1)];
    const Vec3 &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
    const Vec3 n = cross(b - a, c - a);
    if (norm(n) == 0) continue;
    double u = unit(random), v = unit(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const auto found = near(a + u * (b - a) + v * (c - a), (1 / norm(n)) * n);
    worst.distance = std::max(worst.distance, found.distance);
    worst.missed = std::max(worst.missed, found.missed);
  }
  return worst;
}

// A wedge of 5.7 degrees along z: its edge is the z axis.
Mesh knife(double length, double height) {
  const double half = 0.5 * 5.7 * pi / 180, x = length, y = length * std::tan(half);
  Mesh m;
  for (const double z : {0.0, height}) {
    m.vertices.push_back({0, 0, z});
    m.vertices.push_back({x, -y, z});
    m.vertices.push_back({x, y, z});
  }
  m.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3},
                 {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
  return m;
}

}  // namespace

TEST_CASE("between the points of a shell with a tolerance, no flat obstacle enters farther") {
  struct Case {
    const char* name;
    Mesh mesh;
    double tolerance, spacing;
  };
  const Case cases[] = {{"torus", torus(0.03, 0.01, 240, 120), 2e-5, 0},
                        {"torus, coarse", torus(0.03, 0.01, 240, 120), 2e-4, 0},
                        {"torus of large triangles", torus(0.03, 0.01, 24, 12), 2e-5, 2e-3},
                        {"sphere", sphere(0.02), 1e-5, 2e-3},
                        {"box", box({0, 0, 0}, {0.04, 0.03, 0.001}), 5e-5, 0},
                        {"knife", knife(0.03, 0.04), 5e-5, 0}};
  for (const Case& c : cases) {
    CAPTURE(std::string(c.name));
    const double spacing = c.spacing > 0 ? c.spacing : 16 * c.tolerance;
    const ShellData shell = baked_to(c.mesh, c.tolerance, c.spacing);
    const Worst worst = worst_of(shell, c.mesh, spacing, 100000);
    CHECK(worst.missed <= 1.001 * c.tolerance);
    CHECK(worst.distance <= 1.25 * spacing);
  }
}

TEST_CASE("a knife edge has points with its own normal and with those of both faces") {
  const double tolerance = 5e-5, height = 0.04;
  const Mesh mesh = knife(0.03, height);
  const ShellData shell = baked_to(mesh, tolerance);
  const double half = 0.5 * 5.7 * pi / 180;
  const Vec3 kinds[3] = {
      {1, 0, 0}, {std::sin(half), std::cos(half), 0}, {std::sin(half), -std::cos(half), 0}};
  for (const Vec3& kind : kinds) {
    std::vector<double> along;
    for (std::size_t i = 0; i < shell.size(); ++i)
      if (std::hypot(shell.x[i], shell.y[i]) < 1e-9 && dot(normal(shell, i), kind) > 0.9999)
        along.push_back(shell.z[i]);
    std::sort(along.begin(), along.end());
    REQUIRE(along.size() > 10);
    double widest = std::max(along.front(), height - along.back());
    for (std::size_t i = 1; i < along.size(); ++i)
      widest = std::max(widest, along[i] - along[i - 1]);
    CHECK(widest <= 2.25 * 16 * tolerance * 1.001);  // candidates are a quarter apart
  }
}

TEST_CASE("a cube's corners and edges have points of their own") {
  const double side = 0.02, tolerance = 1e-4;
  const ShellData shell = baked_to(box({0, 0, 0}, {side, side, side}), tolerance);
  for (int c = 0; c < 8; ++c) {
    const Vec3 p{c & 1 ? side : 0, c & 2 ? side : 0, c & 4 ? side : 0};
    bool own = false;
    for (std::size_t i = 0; i < shell.size(); ++i)
      own = own || (norm(point(shell, i) - p) < 1e-9 &&
                    dot(normal(shell, i), h6::unit(Vec3{side, side, side} - 2.0 * p)) > 0.9999);
    CHECK(own);
  }
  std::size_t on_edge = 0;
  for (std::size_t i = 0; i < shell.size(); ++i)
    on_edge += shell.y[i] == 0 && shell.z[i] == 0 &&
               dot(normal(shell, i), Vec3{0, std::sqrt(0.5), std::sqrt(0.5)}) > 0.9999;
  CHECK(double(on_edge) >= side / (2 * 16 * tolerance));
  // Large spacing and small tolerance: the corners stay.
  const ShellData coarse = baked_to(box({0, 0, 0}, {side, side, side}), 1e-3, 1);
  CHECK(coarse.size() >= 8);
  for (int c = 0; c < 8; ++c) {
    const Vec3 p{c & 1 ? side : 0, c & 2 ? side : 0, c & 4 ? side : 0};
    bool there = false;
    for (std::size_t i = 0; i < coarse.size(); ++i) there |= norm(point(coarse, i) - p) < 1e-9;
    CHECK(there);
  }
}

TEST_CASE("the rim of an open sheet has points with both normals and with the way into the sheet") {
  Mesh sheet = box({0, 0, 0}, {0.02, 0.03, 0.01});
  sheet.triangles.resize(2);  // the face at z = 0
  const ShellData shell = baked_to(sheet, 1e-4);
  std::size_t kinds[3] = {};
  for (std::size_t i = 0; i < shell.size(); ++i) {
    if (shell.x[i] != 0 || shell.y[i] < 0.005 || shell.y[i] > 0.025) continue;
    const Vec3 n = normal(shell, i);
    kinds[0] += n.x > 0.99, kinds[1] += n.z > 0.99, kinds[2] += n.z < -0.99;
  }
  for (const std::size_t k : kinds) CHECK(k >= 5);
}

TEST_CASE("a shell with a tolerance is the same on any number of threads") {
  const Mesh mesh = torus(0.03, 0.01, 60, 30);
  CHECK(same_bits(baked_to(mesh, 1e-4, 0, 1), baked_to(mesh, 1e-4, 0, 3)));
}

TEST_CASE(
    "a tolerance that is no length, takes too many points or is not for triangles is refused") {
  const Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  ShellBake options;
  for (const double bad : {-1.0, double(NAN), double(INFINITY)}) {
    options.tolerance = bad;
    CHECK_FALSE(bake_shell(mesh, options, nullptr));
  }
  options.tolerance = 1e-6;
  const auto many = bake_shell(mesh, options, nullptr);
  REQUIRE_FALSE(many);
  CHECK(many.error().find("more than the 20 million") != std::string::npos);
  options.tolerance = 1e-3;
  options.surface = ShellSurface::field;
  const auto field = bake_shell(mesh, options, nullptr);
  REQUIRE_FALSE(field);
  CHECK(field.error().find("leave surface and normals at auto") != std::string::npos);
}
