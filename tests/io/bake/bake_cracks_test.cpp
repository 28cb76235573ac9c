// SPDX-License-Identifier: Apache-2.0
// Solids with cracks and holes against their exact winding number.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "io/bake/bake_field.h"
#include "io/bake/holes.h"
#include "tests/io/bake/field_check.h"

using namespace field_check;
using h6::io::bake_field;
using h6::io::FieldBake;
using h6::io::FieldBakeReport;
using h6::io::SignMode;

namespace {

constexpr double kVoxel = 1.0 / 40;

FieldData must_bake(const Mesh& mesh, const FieldBake& options, FieldBakeReport* report) {
  auto field = bake_field(mesh, options, report);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}
FieldBake options_for(SignMode sign, double seal = 0) {
  FieldBake options;
  options.voxel_size = kVoxel;
  options.threads = 2;
  options.sign = sign;
  options.seal = seal;
  return options;
}
bool says(const FieldBakeReport& report, const std::string& words) {
  return std::any_of(report.warnings.begin(), report.warnings.end(),
                     [&](const std::string& w) { return w.find(words) != std::string::npos; });
}
Vec3 direction(Random& random) {
  Vec3 d;
  do d = {random(-1, 1), random(-1, 1), random(-1, 1)};
  while (norm(d) > 1 || norm(d) < 0.1);
  return (1 / norm(d)) * d;
}
Vec3 middle_of(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return (1.0 / 3) * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]);
}

// All triangles on one side of a plane move away from it: a crack along triangle edges.
Mesh cracked(const Mesh& mesh, double width, Random& random) {
  const Vec3 n = direction(random);
  const double at = random(-0.3, 0.3);
  Mesh out;
  for (const auto& t : mesh.triangles) {
    const Vec3 by = (dot(n, middle_of(mesh, t)) > at ? width : 0.0) * n;
    const auto base = std::uint32_t(out.vertices.size());
    for (const std::uint32_t v : t) out.vertices.push_back(mesh.vertices[v] + by);
    out.triangles.push_back({base, base + 1, base + 2});
  }
  return h6::io::weld(out);
}

// Without the triangles around one of its vertices.
Mesh holed(Mesh mesh, double width, Random& random) {
  const Vec3 at = mesh.vertices[random.below(mesh.vertices.size())];
  std::erase_if(mesh.triangles,
                [&](const auto& t) { return norm(middle_of(mesh, t) - at) < width / 2; });
  return h6::io::weld(mesh);
}

// The project's solids, with their triangles wound outwards.
std::vector<Mesh> solids() {
  std::vector<Mesh> out = {sphere({0, 0, 0}, 0.7, 20), torus(0.8, 0.35, 80, 36),
                           turned(box({-0.6, -0.5, -0.4}, {0.6, 0.5, 0.4}, 20), 0.3, 0.5)};
  for (Mesh& mesh : out) {
    const double volume = h6::io::audit(mesh).volume;
    REQUIRE(std::fabs(volume) > 0.1);
    if (volume < 0)
      for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  }
  return out;
}

// Nodes farther than `skin` from the mesh, and with a winding farther than `doubt` from one half,
// on the side that the winding does not give them. Beside a plug with an offset there is more
// doubt.
std::size_t wrong_sides(const FieldData& field, const Mesh& mesh, double skin, double doubt,
                        std::size_t& seen) {
  const Judge judge(mesh);
  std::size_t wrong = 0, count = 0;
  for_nodes(field, [&](std::array<int, 3> n, double d) {
    if (count++ % 401 != 0) return;
    const Vec3 p = node_position(field, n);
    if (judge.distance(p) < skin) return;
    const double w = judge.winding(p);
    if (std::fabs(w - 0.5) < doubt) return;
    ++seen;
    wrong += (w > 0.5) != (d < 0);
  });
  return wrong;
}

}  // namespace

TEST_CASE("winding: the tree has the exact winding number, near and far") {
  Random random(2);
  for (const Mesh& solid : solids()) {
    const Mesh mesh = holed(cracked(solid, 0.05, random), 0.3, random);
    auto surface = h6::io::bake::prepare_surface(mesh, 2);
    REQUIRE(surface);
    const h6::io::bake::Winding winding(*surface, 2);
    CHECK(winding.trusted());
    const Judge judge(mesh);
    double worst = 0;
    for (int i = 0; i < 1000; ++i) {
      const Vec3 p{random(-1.2, 1.2), random(-1.2, 1.2), random(-1.2, 1.2)};
      worst = std::max(worst, std::fabs(winding.at(p) - judge.winding(p)));
    }
    CHECK(worst < 0.05);
    MESSAGE("off by at most ", worst);
    CHECK(worst > 0);
  }
}

TEST_CASE("winding: sixteen nodes at once are on the sides that the exact winding number says") {
  Random random(3);
  std::size_t seen = 0, in = 0;
  for (const Mesh& solid : solids()) {
    Mesh mesh = holed(cracked(solid, 0.05, random), 0.3, random);
    for (Vec3& v : mesh.vertices) v = Vec3{100, 200, 300} + 15 * v;  // in voxels
    auto surface = h6::io::bake::prepare_surface(mesh, 2);
    REQUIRE(surface);
    const h6::io::bake::Winding winding(*surface, 2);
    const Judge judge(mesh);
    for (int box = 0; box < 100; ++box) {
      const std::array<int, 3> first{int(100 + random(-20, 16)), int(200 + random(-20, 18)),
                                     int(300 + random(-20, 18))};
      const std::uint32_t inside = winding.inside(first);
      for (int i = 0; i < 16; ++i) {
        const double w = judge.winding(
            Vec3{double(first[0] + i % 4), double(first[1] + i / 4 % 2), double(first[2] + i / 8)});
        if (std::fabs(w - 0.5) < 0.05) continue;
        ++seen;
        in += w > 0.5;
        CHECK((inside >> i & 1) == (w > 0.5 ? 1u : 0u));
      }
    }
  }
  CHECK(in > seen / 20);
  CHECK(in < seen / 2);
}

TEST_CASE("winding: sheets and mixed windings are not trusted, and 'winding' says so") {
  Random random(4);
  Mesh mixed = sphere({0, 0, 0}, 0.7, 16);
  for (auto& t : mixed.triangles)
    if (random(0, 1) < 0.4) std::swap(t[1], t[2]);
  mixed.triangles.pop_back();
  const Mesh sheet = patch(20, 20, [](double s, double t) { return Vec3{s, t, 0.1 * s * t}; });
  for (const Mesh& mesh : {mixed, sheet}) {
    const auto field = bake_field(mesh, options_for(SignMode::winding), nullptr);
    REQUIRE_FALSE(field);
    CHECK(field.error().find("wound") != std::string::npos);
  }
}

TEST_CASE("cracks: by winding every node has its side, whatever the crack is wide, and no offset") {
  Random random(5);
  for (const double width : {0.1, 0.5, 1.0, 2.0, 4.0})
    for (const Mesh& solid : solids()) {
      Mesh mesh = cracked(cracked(solid, width * kVoxel, random), width * kVoxel, random);
      if (width == 2.0)  // inwards is as good
        for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
      FieldBakeReport report;
      const FieldData field = must_bake(mesh, options_for(SignMode::winding), &report);
      CAPTURE(width);
      CHECK(field.sign_mode == "winding");
      CHECK(field.offset == 0);
      CHECK(report.leaks.empty());
      if (width == 2.0)
        for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
      std::size_t seen = 0;
      CHECK(wrong_sides(field, mesh, kVoxel, 0.1, seen) == 0);
      CHECK(seen > 25);
    }
}

TEST_CASE("cracks: by winding holes of up to 20 voxels close, and they are said") {
  Random random(6);
  for (const double width : {3.0, 9.0, 20.0})
    for (const Mesh& solid : solids()) {
      const Mesh mesh = holed(solid, width * kVoxel, random);
      FieldBakeReport report;
      const FieldData field = must_bake(mesh, options_for(SignMode::winding), &report);
      CAPTURE(width);
      CHECK(report.leaks.empty());
      REQUIRE_FALSE(report.sealed.empty());
      CHECK(report.sealed.size() <= 3);  // a rim may leave parts that hang at a corner
      CHECK(report.sealed[0].width < (width + 3) * kVoxel);
      CHECK(report.sealed[0].width > (0.6 * width - 2) * kVoxel);
      CHECK(says(report, "closed, "));
      std::size_t seen = 0;
      CHECK(wrong_sides(field, mesh, kVoxel, 0.1, seen) == 0);
      CHECK(seen > 25);
    }
}

TEST_CASE("cracks: a seal as wide as the crack closes it, and what is too narrow names the leak") {
  Random random(7);
  for (const double width : {2.5, 4.0})
    for (const Mesh& solid : solids()) {
      const Mesh mesh = cracked(solid, width * kVoxel, random);
      CAPTURE(width);
      FieldBakeReport report;
      const FieldData held =
          must_bake(mesh, options_for(SignMode::automatic, (width + 1) * kVoxel), &report);
      CHECK(report.leaks.empty());
      CHECK_FALSE(report.sealed.empty());
      std::size_t seen = 0;
      CHECK(wrong_sides(held, mesh, held.offset + kVoxel, 0.4, seen) == 0);
      CHECK(seen > 25);
      must_bake(mesh, options_for(SignMode::flood), &report);
      REQUIRE(report.leaks.size() == 1);
      CHECK(says(report, "runs into the solid"));
      CHECK(says(report, "--sign winding"));
      // The leak is beside the mesh and in the crack.
      CHECK(Judge(mesh).distance(report.leaks[0].place) < (width / 2 + 1) * kVoxel);
    }
}

TEST_CASE("cracks: a hole too wide for the seal stays open, is named, and nothing is half closed") {
  Random random(8);
  for (const Mesh& solid : solids()) {
    const Mesh mesh = holed(solid, 12 * kVoxel, random);
    FieldBakeReport plain, narrow;
    const FieldData a = must_bake(mesh, options_for(SignMode::flood), &plain),
                    b = must_bake(mesh, options_for(SignMode::automatic, 4 * kVoxel), &narrow);
    REQUIRE(plain.leaks.size() == 1);
    REQUIRE(narrow.leaks.size() == 1);
    CHECK(narrow.sealed.empty());
    CHECK(says(narrow, "seal wider"));
    CHECK(narrow.leaks[0].width > 6 * kVoxel);
    CHECK(a.brick_index == b.brick_index);
    CHECK(std::memcmp(a.samples.data(), b.samples.data(), 4 * a.samples.size()) == 0);
  }
}

TEST_CASE("cracks: a line of a triangle far beyond the solid is no hole of it") {
  Random random(10);
  Mesh mesh = holed(solids()[0], 6 * kVoxel, random);
  FieldBakeReport report;
  const FieldData alone = must_bake(mesh, options_for(SignMode::winding), &report);
  const auto base = std::uint32_t(mesh.vertices.size());
  for (const double x : {1e6, 1e6 + 1, 1e6 + 2}) mesh.vertices.push_back({x, x, -x});
  mesh.triangles.push_back({base, base + 1, base + 2});
  for (const SignMode sign : {SignMode::winding, SignMode::automatic})
    must_bake(mesh, options_for(sign), &report);
  const FieldData both = must_bake(mesh, options_for(SignMode::winding), &report);
  REQUIRE(alone.samples.size() == both.samples.size());
  CHECK(std::memcmp(alone.samples.data(), both.samples.data(), 4 * alone.samples.size()) == 0);
}

TEST_CASE("cracks: a closed mesh by winding is the closed mesh, and threads change no bit") {
  Random random(9);
  const Mesh solid = solids()[1];
  FieldBakeReport report;
  const FieldData a = must_bake(solid, options_for(SignMode::winding), &report),
                  b = must_bake(solid, options_for(SignMode::automatic), nullptr);
  CHECK(a.sign_mode == "closed");
  CHECK(report.warnings.empty());
  CHECK(std::memcmp(a.samples.data(), b.samples.data(), 4 * a.samples.size()) == 0);
  const Mesh mesh = holed(cracked(solid, 2 * kVoxel, random), 6 * kVoxel, random);
  FieldBake one = options_for(SignMode::winding);
  one.threads = 1;
  const FieldData c = must_bake(mesh, options_for(SignMode::winding), nullptr),
                  d = must_bake(mesh, one, nullptr);
  REQUIRE(c.samples.size() == d.samples.size());
  CHECK(std::memcmp(c.samples.data(), d.samples.data(), 4 * c.samples.size()) == 0);
}
