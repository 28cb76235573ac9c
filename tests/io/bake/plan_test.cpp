// SPDX-License-Identifier: Apache-2.0
// Memory and time of bakes, said before they run, and bakes that run out of memory.
#include "io/bake/plan.h"

#include <doctest/doctest.h>

#include <cstdint>
#include <optional>
#include <string>

#include "tests/io/bake/field_check.h"

using namespace field_check;
using namespace h6::io;

namespace {

constexpr std::uint64_t kGiga = 1u << 30;

}  // namespace

TEST_CASE("a plan is the bake's own voxel, offset and size, and its bricks to a tenth") {
  Mesh open = torus(1.0, 0.4);
  open.triangles.resize(open.triangles.size() - 40);
  for (const Mesh& mesh : {torus(1.0, 0.4), open, box({0, 0, 0}, {3, 1, 0.5}, 1), shards(50)}) {
    FieldBake options;
    options.voxels = 160;
    const auto plan = plan_field(mesh, audit(mesh), options);
    REQUIRE(plan);
    const auto field = bake_field(mesh, options, nullptr);
    REQUIRE_MESSAGE(field, field.error());
    CHECK(plan->voxel_size == field->voxel_size);
    CHECK(plan->offset == field->offset);
    CHECK(plan->bricks == field->bricks);
    const double ratio = double(plan->brick_count) / double(field->brick_count());
    CAPTURE(ratio);
    CHECK(ratio > 0.85);
    CHECK(ratio < 1.15);
    CHECK(plan->seconds > 0);
  }
  FieldBake tiny;
  tiny.voxel_size = 1e-6;
  CHECK(!plan_field(open, audit(open), tiny));  // the bake's own sentence
  // A tolerance that takes too many nodes is answered in tolerances, however small it is.
  for (const double tolerance : {8e-4, 1e-4, 1e-9, 1e-300}) {
    CAPTURE(tolerance);
    FieldBake least;
    least.tolerance = tolerance;
    const auto none = plan_field(open, audit(open), least);
    REQUIRE_FALSE(none);
    CHECK(none.error().starts_with("a tolerance of "));
    const double enough = std::stod(none.error().substr(none.error().rfind("least ") + 6));
    CHECK(enough < 2e-3);
    least.tolerance = 1.001 * enough;
    CHECK(plan_field(open, audit(open), least));
  }
  // Too much surface to look at every triangle: the estimate still comes soon.
  Mesh heap;
  for (int i = 0; i < 40; ++i)
    add(heap, turned(box({-1, -1, -1}, {1, 1, 1}, 1), 0.1 * i, 0.07 * i));
  FieldBake fine;
  fine.voxels = 2048;
  const auto plan = plan_field(heap, audit(heap), fine);
  REQUIRE(plan);
  CHECK(plan->brick_count > 1000000);
}

TEST_CASE("to a tolerance, many edges are planned with more memory than one smooth side") {
  // As many bricks, in which a plate of two triangles lies flat, or a sheet is folded.
  const auto folded = [](double height) {
    Mesh mesh;
    const int n = 40;
    for (int i = 0; i <= n; ++i)
      for (const double y : {0.0, 4.0}) mesh.vertices.push_back({0.1 * i, y, height * (i % 2)});
    for (std::uint32_t i = 0; i < n; ++i) {
      mesh.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
      mesh.triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
    }
    return mesh;
  };
  FieldBake options;
  options.tolerance = 4.0 / 1000;
  const Mesh plain = folded(0.001), sharp = folded(0.1);
  const auto flat = plan_field(plain, audit(plain), options);
  const auto folds = plan_field(sharp, audit(sharp), options);
  REQUIRE(flat);
  REQUIRE(folds);
  CHECK(folds->bytes > flat->bytes + 8000 * flat->brick_count / 2);
  CHECK(folds->peak_bytes > flat->peak_bytes + 30'000 * flat->brick_count);
  options.tolerance = 0;
  const auto uniform = plan_field(plain, audit(plain), options);
  REQUIRE(uniform);
  CHECK(uniform->peak_bytes < flat->peak_bytes);
}

TEST_CASE("a bake that cannot fit is refused in one sentence, with voxels that would") {
  FieldPlan plan;
  plan.peak_bytes = 4 * kGiga, plan.seconds = 3;
  // A plan may be twice too high, and the bake itself looks again.
  for (const std::uint64_t free : {5 * kGiga, 3 * kGiga}) {
    const auto fits = needs_of(plan, free);
    REQUIRE(fits);
    CHECK(*fits == "about 4.3 GB of memory and 3 s");
  }
  const auto small = needs_of(plan, kGiga);
  REQUIRE_FALSE(small);
  CHECK(small.error() ==
        "this bake takes about 4.3 GB of memory, and 1.1 GB are free: choose voxels, or a "
        "tolerance, 2.1 times as large");
}

TEST_CASE("a bake that runs out of memory says so, wherever it asks for more") {
  static int asked, enough;  // a pointer to a function captures nothing
  const auto free_memory = [] {
    return std::optional<std::uint64_t>(asked++ < enough ? kGiga : 0);
  };
  const Mesh mesh = box({0, 0, 0}, {3, 2, 1}, 1);
  for (const double tolerance : {0.0, 3.0 / 200}) {
    CAPTURE(tolerance);
    FieldBake options;
    options.tolerance = tolerance, options.voxels = 64, options.threads = 2;
    options.free_memory = [] { return std::optional<std::uint64_t>(); };
    const auto whole = bake_field(mesh, options, nullptr);
    REQUIRE(whole);
    options.free_memory = free_memory;
    int times = 0;
    for (enough = 0;; ++enough, ++times) {
      asked = 0;
      const auto field = bake_field(mesh, options, nullptr);
      if (field) {
        CHECK(field->samples == whole->samples);
        CHECK(field->quarters == whole->quarters);
        break;
      }
      CHECK(asked == enough + 1);
      CHECK(field.error().starts_with("this bake takes "));
      CHECK(field.error().find(" of memory") != std::string::npos);
      REQUIRE(times < 20);
    }
    // Before the pairs and the rows of each of three grids, and before the finer samples.
    CHECK(times >= (tolerance > 0 ? 7 : 2));
  }
}

TEST_CASE("many small triangles are planned as they are baked: with all fine bricks") {
  FieldBake options;
  const Mesh coarse = sphere({0, 0, 0}, 1.0, 12), dense = sphere({0, 0, 0}, 1.0, 120);
  options.tolerance = 0.01;
  const auto few = plan_field(coarse, audit(coarse), options),
             many = plan_field(dense, audit(dense), options);
  REQUIRE(few);
  REQUIRE(many);
  REQUIRE(dense.triangles.size() > 20 * many->brick_count);
  CHECK(many->peak_bytes - 800 * dense.triangles.size() >
        few->peak_bytes - 800 * coarse.triangles.size() + 30'000 * many->brick_count);
}
