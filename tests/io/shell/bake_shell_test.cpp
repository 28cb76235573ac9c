// SPDX-License-Identifier: Apache-2.0
// Shells have exact numbers of points, blue noise, inward normals, nested levels and whole spheres.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "io/mesh/mesh_file.h"
#include "io/shell/bake_shell.h"
#include "tests/io/shell/shell_test_meshes.h"

using namespace shells;
using h6::Result;
using h6::io::bake_shell;
using h6::io::build_shell;
using h6::io::PointCloud;
using h6::io::ShellBake;

namespace {

ShellData baked(const Mesh& mesh, std::size_t points,
                std::vector<std::string>* warnings = nullptr) {
  ShellBake options;
  options.points = points;
  Result<ShellData> shell = bake_shell(mesh, options, warnings);
  REQUIRE_MESSAGE(shell, shell.error());
  REQUIRE(shell->size() == points);
  return *shell;
}

void check_levels_are_blue(const ShellData& shell) {
  for (const std::size_t count : shell.level_points) {
    if (count < 2) continue;
    const Spacing s = spacing(shell, count);
    CAPTURE(count);
    CHECK(s.least / s.mean >= 0.6);
  }
}

void check_ratios(const ShellData& shell) {
  for (std::size_t k = 1; k < shell.level_points.size(); ++k) {
    const double ratio = double(shell.level_points[k]) / shell.level_points[k - 1];
    if (shell.level_points[k - 1] < 10) continue;  // rounding
    CHECK(ratio > 2.8);
    CHECK(ratio < 4.2);
  }
}

double distance_to_plane(const Mesh& mesh, const ShellData& s, std::size_t i) {
  const auto& f = mesh.triangles[s.source[i]];
  const Vec3 a = mesh.vertices[f[0]], b = mesh.vertices[f[1]], c = mesh.vertices[f[2]];
  const Vec3 n = cross(b - a, c - a), p = point(s, i);
  // Inside the triangle: beyond no edge by more than rounding.
  double out = std::abs(dot(p - a, n)) / std::sqrt(dot(n, n));
  const Vec3 corners[3] = {a, b, c};
  for (int k = 0; k < 3; ++k) {
    const Vec3 edge = corners[(k + 1) % 3] - corners[k], side = cross(n, edge);
    out = std::max(out, -dot(p - corners[k], side) / std::sqrt(dot(side, side)));
  }
  return out;
}

std::vector<std::array<float, 3>> sorted_points(const std::vector<float>& x,
                                                const std::vector<float>& y,
                                                const std::vector<float>& z) {
  std::vector<std::array<float, 3>> out;
  for (std::size_t i = 0; i < x.size(); ++i) out.push_back({x[i], y[i], z[i]});
  std::sort(out.begin(), out.end());
  return out;
}

void add_point(PointCloud& cloud, double x, double y, double z) {
  cloud.x.push_back(float(x)), cloud.y.push_back(float(y)), cloud.z.push_back(float(z));
  cloud.nx.push_back(0), cloud.ny.push_back(0), cloud.nz.push_back(1);
}

ShellData check_cloud(const PointCloud& cloud, int levels) {
  Result<ShellData> shell = build_shell(cloud, levels);
  REQUIRE_MESSAGE(shell, shell.error());
  CHECK(std::string(broken_promise(*shell)) == "");
  CHECK(h6::io::check_shell(*shell));
  CHECK(sorted_points(shell->x, shell->y, shell->z) == sorted_points(cloud.x, cloud.y, cloud.z));
  return *shell;
}

}  // namespace

TEST_CASE("a torus gets exactly 25,269 points in seven nested blue-noise levels") {
  const Mesh mesh = torus(0.03, 0.01);
  const ShellData shell = baked(mesh, 25269);
  CHECK(shell.level_points.size() == 7);
  check_levels_are_blue(shell);
  check_ratios(shell);
  CHECK(std::string(broken_promise(shell)) == "");
  CHECK(h6::io::check_shell(shell));
}

TEST_CASE("spheres, boxes and plates get the number asked for, whatever it is") {
  const Mesh round = sphere(0.02, 24), cube = box({0, 0, 0}, {0.03, 0.02, 0.01});
  for (const std::size_t points : {1, 2, 3, 7, 64, 1000, 3001}) {
    for (const Mesh* mesh : {&round, &cube}) {
      CAPTURE(points);
      const ShellData shell = baked(*mesh, points);
      check_levels_are_blue(shell);
      check_ratios(shell);
      CHECK(std::string(broken_promise(shell)) == "");
    }
  }
}

TEST_CASE("no part of the surface is left out: every place has a point near it") {
  const ShellData shell = baked(sphere(1.0, 48), 2000);
  const double mean_area = 4 * pi / 2000;
  std::mt19937_64 random(5);
  double widest = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto unit = [&] { return double(random() >> 11) * 0x1p-53; };
    const double z = 2 * unit() - 1, a = 2 * pi * unit(), r = std::sqrt(1 - z * z);
    const Vec3 p{r * std::cos(a), r * std::sin(a), z};
    double best = INFINITY;
    for (std::size_t k = 0; k < shell.size(); ++k) {
      const Vec3 d = p - point(shell, k);
      best = std::min(best, dot(d, d));
    }
    widest = std::max(widest, std::sqrt(best));
  }
  CHECK(widest < 1.1 * std::sqrt(mean_area));
}

TEST_CASE("every point lies on the triangle it is said to come from") {
  for (const Mesh& mesh : {torus(0.03, 0.01), sphere(0.02, 32), box({-1, 2, 0}, {1, 2.5, 0.01})}) {
    const ShellData shell = baked(mesh, 2000);
    REQUIRE(shell.source.size() == shell.size());
    double worst = 0;
    for (std::size_t i = 0; i < shell.size(); ++i) {
      worst = std::max(worst, distance_to_plane(mesh, shell, i));
    }
    CHECK(worst < 3e-7);  // float rounding of places up to 2.5 m
  }
}

TEST_CASE("normals of a fine sphere point at its middle, however it is wound") {
  const Mesh good = sphere(0.02, 96);
  Mesh mixed = good;
  std::mt19937_64 random(3);
  for (auto& t : mixed.triangles) {
    if (random() & 1) std::swap(t[1], t[2]);
  }
  for (const Mesh& mesh : {good, inside_out(good), mixed}) {
    const ShellData shell = baked(mesh, 2000);
    double worst = 1;
    for (std::size_t i = 0; i < shell.size(); ++i) {
      const Vec3 p = point(shell, i), n = normal(shell, i);
      worst = std::min(worst, -dot(p, n) / std::sqrt(dot(p, p)));
    }
    CHECK(worst > std::cos(2 * pi / 180));
  }
}

TEST_CASE("turning normals is said, and a sound mesh gives no warning") {
  std::vector<std::string> sound, turned, open;
  baked(sphere(1, 24), 500, &sound);
  baked(inside_out(sphere(1, 24)), 500, &turned);
  Mesh cut = sphere(1, 24);
  cut.triangles.resize(cut.triangles.size() - 300);
  const ShellData bowl = baked(cut, 500, &open);
  CHECK(sound.empty());
  CHECK(turned.size() == 1);
  CHECK(open.size() == 1);
  std::size_t within = 0;  // a bowl is touched from both sides
  for (std::size_t i = 0; i < bowl.size(); ++i) within += dot(point(bowl, i), normal(bowl, i)) > 0;
  CHECK(within > 150);
  CHECK(within < 350);
}

TEST_CASE("both sides of a plate far thinner than the spacing are sampled alike") {
  const Mesh plate = box({0, 0, 0}, {0.1, 0.1, 0.0002});
  const ShellData shell = baked(plate, 2000);  // spacing about 3 mm
  std::size_t up = 0, down = 0;
  for (std::size_t i = 0; i < shell.size(); ++i) {
    up += shell.nz[i] > 0.5;
    down += shell.nz[i] < -0.5;
  }
  CHECK(up > 900);
  CHECK(down > 900);
  CHECK(std::string(broken_promise(shell)) == "");
}

TEST_CASE("a surface that is stored twice is sampled once") {
  Mesh twice = sphere(1, 24);
  add(twice, inside_out(sphere(1, 24)));
  const ShellData shell = baked(twice, 1000);
  const Spacing s = spacing(shell, shell.size());
  CHECK(s.least / s.mean >= 0.6);
  for (std::size_t i = 0; i < shell.size(); ++i) CHECK(dot(point(shell, i), normal(shell, i)) < 0);
}

TEST_CASE("any number of threads gives the same bits, another seed gives other points") {
  const Mesh mesh = torus(0.03, 0.01);
  ShellBake options;
  options.points = 9000;
  options.threads = 1;
  const auto one = bake_shell(mesh, options, nullptr);
  for (const unsigned threads : {2u, 5u, 0u}) {
    options.threads = threads;
    const auto more = bake_shell(mesh, options, nullptr);
    REQUIRE(one);
    REQUIRE(more);
    CHECK(same_bits(*one, *more));
  }
  options.seed = 2;
  const auto other = bake_shell(mesh, options, nullptr);
  REQUIRE(other);
  CHECK(one->x != other->x);
}

TEST_CASE("a spacing is kept between all points of one side, and no more would fit much") {
  const double area = 4 * pi * pi * 0.03 * 0.01;
  ShellBake options;
  options.spacing = 0.001;
  const auto shell = bake_shell(torus(0.03, 0.01), options, nullptr);
  REQUIRE(shell);
  CHECK(spacing(*shell, shell->size()).least >= 0.001 * (1 - 1e-6));
  CHECK(double(shell->size()) > 0.6 * area / 1e-6);
  CHECK(double(shell->size()) < 1.1548 * area / 1e-6);  // the densest packing there is
  check_levels_are_blue(*shell);
}

TEST_CASE("a wire far thinner than the spacing is sampled along all of its length") {
  const ShellData shell = baked(box({0, 0, 0}, {1, 0.0005, 0.0005}), 300);
  std::vector<float> along = shell.x;
  std::sort(along.begin(), along.end());
  float gap = std::max(along.front(), 1 - along.back());
  for (std::size_t i = 1; i < along.size(); ++i) gap = std::max(gap, along[i] - along[i - 1]);
  CHECK(gap < 0.02f);
}

TEST_CASE("what cannot be baked is refused in a sentence") {
  const Mesh good = sphere(1, 12);
  const auto refused = [](const Mesh& mesh, const ShellBake& options) {
    const auto shell = bake_shell(mesh, options, nullptr);
    CHECK_FALSE(shell);
    CHECK(shell.error().size() > 20);
    CHECK(shell.error().back() == '.');
  };
  const auto with = [](auto change) {
    ShellBake options;
    change(options);
    return options;
  };
  refused(good, with([](ShellBake& o) { o.points = 0; }));
  refused(good, with([](ShellBake& o) { o.points = 20'000'001; }));
  refused(good, with([](ShellBake& o) { o.spacing = 1e-5; }));
  refused(good, with([](ShellBake& o) { o.spacing = 1e-300; }));
  refused(good, with([](ShellBake& o) { o.spacing = -1; }));
  refused(good, with([](ShellBake& o) { o.spacing = NAN; }));
  refused(good, with([](ShellBake& o) { o.spacing = INFINITY; }));
  refused(good, with([](ShellBake& o) { o.levels = 0; }));
  refused(good, with([](ShellBake& o) { o.levels = 17; }));
  refused(Mesh{}, {});
  Mesh line;
  line.vertices = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
  line.triangles = {{0, 1, 2}, {0, 0, 1}};
  refused(line, {});
  Mesh outside = good;
  outside.triangles[5][1] = 1'000'000;
  refused(outside, {});
  Mesh nowhere = good;
  nowhere.vertices[5].y = NAN;
  refused(nowhere, {});
}

TEST_CASE("a spacing wider than the body still gives a point, and cancelling ends the work") {
  ShellBake options;
  options.spacing = 1e9;
  const auto shell = bake_shell(sphere(1, 12), options, nullptr);
  REQUIRE(shell);
  CHECK(shell->size() >= 1);
  CHECK(shell->size() <= 3);
  const auto cancelled = bake_shell(sphere(1, 12), {}, nullptr,
                                    [](const std::string&, double done) { return done < 0.5; });
  CHECK_FALSE(cancelled);
  CHECK(cancelled.error() == "cancelled");
}

TEST_CASE("fewer points than the levels need make fewer levels") {
  CHECK(baked(sphere(1, 12), 20).level_points.size() == 3);
  CHECK(baked(sphere(1, 12), 800).level_points.size() == 7);
  CHECK(baked(sphere(1, 12), 1).level_points.size() == 1);
}

TEST_CASE("slivers, hostile scales and far away bodies do not break a bake") {
  Mesh tiny = sphere(1e-9, 12), far = sphere(0.01, 12);
  for (auto& v : far.vertices) v.x += 999'000;
  Mesh thin = box({0, 0, 0}, {1e5, 1e-7, 1e-7});
  for (const Mesh& mesh : {tiny, far, thin}) {
    const ShellData shell = baked(mesh, 500);
    CHECK(std::string(broken_promise(shell)) == "");
  }
}

TEST_CASE("a given grid keeps its points and gets a sphere tree") {
  PointCloud cloud;
  for (int i = 0; i < 20 * 20 * 20; ++i) {
    add_point(cloud, i % 20 * 0.001, i / 20 % 20 * 0.001, i / 400 * 0.001);
    cloud.source.push_back(std::uint32_t(i));
  }
  const ShellData shell = check_cloud(cloud, 5);
  CHECK(shell.level_points.size() == 5);
  check_ratios(shell);
  check_levels_are_blue(shell);
  for (std::size_t i = 0; i < shell.size(); ++i) {
    const std::size_t from = shell.source[i];
    const bool same =
        shell.x[i] == cloud.x[from] && shell.y[i] == cloud.y[from] && shell.z[i] == cloud.z[from];
    CHECK(same);
  }
}

TEST_CASE("children hang from the nearest point of their level") {
  const ShellData s = baked(torus(0.03, 0.01), 1500);
  for (std::size_t k = 0; k + 1 < s.level_points.size(); ++k) {
    for (std::size_t r = s.level_first[k]; r < s.level_first[k + 1]; ++r) {
      for (std::size_t c = 1; c < s.node_child_count[r]; ++c) {
        const Vec3 p = point(s, s.node_point[s.node_first_child[r] + c]);
        const Vec3 own = p - point(s, s.node_point[r]);
        double best = INFINITY;
        for (std::size_t q = 0; q < s.level_points[k]; ++q) {
          const Vec3 d = p - point(s, q);
          best = std::min(best, dot(d, d));
        }
        CHECK(dot(own, own) == best);
      }
    }
  }
}

TEST_CASE("coinciding, collinear, clustered and single points all get a tree") {
  PointCloud one, same, pairs, line, clusters;
  add_point(one, 1, 2, 3);
  std::mt19937_64 random(9);
  for (int i = 0; i < 3000; ++i) {
    const auto unit = [&] { return double(random() >> 11) * 0x1p-53; };
    add_point(same, 0.5, 0.5, 0.5);
    add_point(pairs, i / 2 % 50, i / 100, 0);
    add_point(line, 0, i * 0.25, 0);
    const double far = i == 0 ? 1e5 : 0;
    add_point(clusters, far + 1e-9 * unit(), 1e-9 * unit(), 1e-9 * unit());
  }
  for (const int levels : {1, 3, 7, 16}) {
    check_cloud(one, levels);
    check_cloud(same, levels);
    check_cloud(pairs, levels);
    check_cloud(line, levels);
    check_cloud(clusters, levels);
  }
  check_levels_are_blue(check_cloud(line, 7));
}

TEST_CASE("clouds that are no shell are refused in a sentence") {
  PointCloud cloud;
  CHECK_FALSE(build_shell(cloud, 7));
  add_point(cloud, 0, 0, 0);
  CHECK(build_shell(cloud, 7));
  CHECK_FALSE(build_shell(cloud, 0));
  CHECK_FALSE(build_shell(cloud, 33));
  for (const float bad : {NAN, INFINITY, 0.0f, 2.0f}) {
    PointCloud broken = cloud;
    broken.nz[0] = bad;
    CHECK_FALSE(build_shell(broken, 7));
  }
  for (const float bad : {NAN, INFINITY, 2e6f}) {
    PointCloud broken = cloud;
    broken.y[0] = bad;
    CHECK_FALSE(build_shell(broken, 7));
  }
  PointCloud shorter = cloud;
  shorter.ny.clear();
  CHECK_FALSE(build_shell(shorter, 7));
  shorter = cloud;
  shorter.source = {1, 2};
  CHECK_FALSE(build_shell(shorter, 7));
}

TEST_CASE("real meshes give whole shells of exactly the number asked for") {
  const char* folder = std::getenv("HAPSIX_TEST_DATA");
  const auto file = std::filesystem::path(folder ? folder : "") / "nut-bolt";
  std::error_code error;
  if (!folder || !std::filesystem::exists(file, error)) {
    MESSAGE("skipped: no real meshes");
    return;
  }
  for (const auto& entry : std::filesystem::directory_iterator(file)) {
    const auto mesh = h6::io::read_mesh(entry.path());
    REQUIRE_MESSAGE(mesh, mesh.error());
    const ShellData shell = baked(*mesh, 38148);
    CHECK(std::string(broken_promise(shell)) == "");
  }
}
