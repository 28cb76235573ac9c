// SPDX-License-Identifier: Apache-2.0
// foreign_test.cpp - level sets of other programs: how far their band reaches as ours, and what
// stands beyond it.
#include <doctest/doctest.h>

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "io/field/extend_band.h"
#include "io/field/field_file.h"
#include "io/field/lipschitz.h"
#include "tests/io/field/field_samples.h"

using namespace field_samples;
using namespace h6::io;

namespace {

constexpr double kVoxel = 0.05;
const Vec3 kMiddle{0.31, -0.22, 5.03};

double to_sphere(Vec3 p) { return norm(p - kMiddle) - 1.0; }

openvdb::FloatGrid::Ptr sphere(double half_width) {
  openvdb::initialize();
  return openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      1.0f, openvdb::Vec3f(float(kMiddle.x), float(kMiddle.y), float(kMiddle.z)), float(kVoxel),
      float(half_width));
}

FieldData read_back(const openvdb::FloatGrid::Ptr& grid) {
  const Folder folder;
  openvdb::io::File out((folder.path / "other.vdb").string());
  out.write(openvdb::GridPtrVec{grid});
  out.close();
  const auto field = read_field(folder.path / "other.vdb");
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}

// `side` bricks along each axis, voxels of 1 m, all with samples of clamp(distance, -band, band).
FieldData box_of_bricks(int side, double band, const std::function<double(Vec3)>& distance) {
  FieldData f;
  f.bricks = {side, side, side};
  f.voxel_size = 1;
  f.band = band;
  for (int c = 0; c < side * side * side; ++c) {
    f.brick_index.push_back(c);
    for (int n = 0; n < 512; ++n) {
      const int at[3] = {8 * (c % side) + n % 8, 8 * (c / side % side) + n / 8 % 8,
                         8 * (c / side / side) + n / 64};
      const double d = distance({double(at[0]), double(at[1]), double(at[2])});
      f.samples.push_back(float(std::clamp(d, -band, band)));
    }
  }
  return f;
}

}  // namespace

TEST_CASE("foreign: a level set of three voxels gives a band of three voxels, whole cells") {
  const FieldData field = read_back(sphere(3));
  CHECK(field.band > 2.999 * kVoxel);
  Random random(2);
  std::size_t missing = 0, wrong = 0;
  for (int i = 0; i < 50000; ++i) {
    const Vec3 p = {kMiddle.x + random(-1.3, 1.3), kMiddle.y + random(-1.3, 1.3),
                    kMiddle.z + random(-1.3, 1.3)};
    const double d = to_sphere(p);
    if (std::fabs(d) >= field.band) continue;
    double value = 0;
    missing += !interpolate(field, p, value);
    wrong += std::fabs(value - d) > 0.3 * kVoxel;
  }
  CHECK(missing == 0);
  CHECK(wrong == 0);
}

TEST_CASE("foreign: neighbours differ by a voxel at most, and no sample is too far out") {
  for (const double half_width : {3.0, 3.7, 5.0}) {
    CAPTURE(half_width);
    const FieldData field = read_back(sphere(half_width));
    CHECK(steepest_edge(field, field.band, 0) <= 1 + kSteepSlack);
    std::size_t too_far = 0, beyond = 0, loose = 0, sides = 0;
    for_nodes(field, [&](std::array<int, 3> n, double d) {
      const double t = to_sphere(node_position(field, n)), size = std::fabs(t);
      too_far += std::fabs(d) > size + 1e-3 * kVoxel;
      sides += (d < 0) != (t < 0) && size > 1e-3 * kVoxel;
      if (size < field.band || size > field.band + 1.75 * kVoxel) return;
      ++beyond;
      loose += std::fabs(d) < size - 0.26 * kVoxel;
    });
    CHECK(too_far == 0);
    CHECK(sides == 0);
    CHECK(beyond > 10000);
    CHECK(loose == 0);
  }
}

TEST_CASE("foreign: values that rise faster than distances can are lowered, and only those") {
  const auto clean = sphere(3), bent = sphere(3);
  // A few nodes at a depth of about two voxels claim to be deeper.
  std::size_t changed = 0, seen = 0;
  for (auto it = bent->beginValueOn(); it; ++it) {
    const float d = it.getValue(), deep = float(kVoxel);
    if (d > -1.9f * deep || d < -2.1f * deep || seen++ % 100 != 0) continue;
    it.setValue(d - 0.8f * deep), ++changed;
  }
  REQUIRE(changed >= 3);
  const FieldData want = read_back(clean), have = read_back(bent);
  CHECK(have.band == want.band);
  REQUIRE(have.samples.size() == want.samples.size());
  std::size_t off = 0, differ = 0;
  for (std::size_t i = 0; i < have.samples.size(); ++i) {
    differ += have.samples[i] != want.samples[i];
    off += std::fabs(have.samples[i] - want.samples[i]) > 0.5f * float(kVoxel);
  }
  CHECK(off == 0);
  CHECK(differ >= changed);
  CHECK(differ <= 100 * changed);  // and what they are the nearest known node of
}

TEST_CASE("foreign: a level set that was cut off keeps the narrow band") {
  const auto grid = sphere(3);
  const auto high = openvdb::Coord::round(grid->worldToIndex({kMiddle.x, kMiddle.y, kMiddle.z}));
  for (auto it = grid->tree().beginLeaf(); it; ++it)
    if (it->origin()[0] > high[0] + 8)
      for (openvdb::Index n = 0; n < 512; ++n) it->setValueOff(n, grid->background());
  grid->tree().prune();
  const FieldData field = read_back(grid);
  CHECK(field.band < 1.3 * kVoxel);
}

TEST_CASE("extend_band: beyond three voxels no sample passes the distance, in any direction") {
  // Few points are the worst of surfaces: other nodes on the way are as far from them as can be.
  Random random(7);
  std::size_t too_far = 0, loose = 0, changed = 0, nodes = 0;
  double longest = 0;
  for (int i = 0; i < 100; ++i) {
    std::vector<Vec3> points;
    for (int k = 0; k <= i % 4; ++k)
      points.push_back({12 + random(-2, 2), 12 + random(-2, 2), 12 + random(-2, 2)});
    const auto distance = [&](Vec3 q) {
      double least = 99;
      for (const Vec3& p : points) least = std::min(least, norm(q - p));
      return least;
    };
    FieldData f = box_of_bricks(3, 3, distance);
    extend_band(
        f, 3, [](std::size_t) { return false; }, 0);
    for_nodes(f, [&](std::array<int, 3> n, double d) {
      const double t = distance({double(n[0]), double(n[1]), double(n[2])});
      changed += t < 3 && float(t) != float(d);
      if (t < 3) return;
      ++nodes;
      too_far += d > t;
      loose += d < std::max(3.0, std::min(t, 5.0) - 0.25) - 1e-5;
      if (d > 3 && t < 4.98) longest = std::max(longest, d - (t - 0.25));
    });
  }
  CHECK(nodes > 30000);
  CHECK(too_far == 0);
  CHECK(loose == 0);
  CHECK(changed == 0);
  CHECK(longest > 0.17);  // a much smaller allowance for detours would not do
}

TEST_CASE("lipschitz: of two sides both are lowered, and the surface between them stays") {
  FieldData f = box_of_bricks(2, 3, [](Vec3 q) { return q.x - 7.25; });
  CHECK(steepest_edge(f, 3, 0) == doctest::Approx(1));
  const auto before = f.samples;
  lower_steep_samples(f);
  CHECK(same(before, f.samples));

  f = box_of_bricks(2, 3, [](Vec3 q) { return q.x < 7.25 ? -0.5 : 1.5; });
  CHECK(steepest_edge(f, 3, 0) == doctest::Approx(2));
  lower_steep_samples(f);
  CHECK(steepest_edge(f, 3, 0) <= 1 + kSteepSlack);
  double inside = 0, outside = 0;
  for_nodes(f, [&](std::array<int, 3> n, double d) {
    if (n[0] == 7) inside = d;
    if (n[0] == 8) outside = d;
  });
  CHECK(inside == doctest::Approx(-0.25));
  CHECK(outside == doctest::Approx(0.75));
}

TEST_CASE("lipschitz: a brick that is missing beside the band counts as steep") {
  FieldData f = box_of_bricks(2, 3, [](Vec3 q) { return q.x - 3.25; });
  CHECK(steepest_edge(f, 3, 0) <= 1 + kSteepSlack);
  f.brick_index[1] = -1;  // beside nodes that are 3 voxels away
  CHECK(steepest_edge(f, 3, 0) <= 1 + kSteepSlack);
  CHECK(steepest_edge(f, 5, 0) > 1.9);
}
