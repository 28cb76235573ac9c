// SPDX-License-Identifier: Apache-2.0
// field_samples.h - fields and a folder for the tests of field files.
#pragma once
#include <doctest/doctest.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "io/bake/bake_field.h"
#include "tests/io/bake/field_check.h"

namespace field_samples {

using namespace field_check;
using namespace h6::io;
namespace fs = std::filesystem;

struct Folder {
  fs::path path = fs::temp_directory_path() / ("hapsix_field_test_" + std::to_string(getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  std::size_t files() const {
    return std::size_t(std::distance(fs::directory_iterator(path), fs::directory_iterator()));
  }
};

inline FieldData baked(int voxels = 48) {
  Mesh mesh = turned(l_shape(0.02), 0.4, 0.3);
  mesh.part.assign(mesh.triangles.size(), 0);
  for (std::size_t i = 0; i < mesh.part.size(); i += 2) mesh.part[i] = 1;
  mesh.part_names = {"left half", "right\nhalf"};
  FieldBake options;
  options.voxels = voxels;
  auto field = bake_field(mesh, options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  return *field;
}

inline FieldData refined() {
  FieldBake options;
  options.tolerance = 2e-4;
  auto field = bake_field(turned(l_shape(0.02), 0.4, 0.3), options, nullptr);
  REQUIRE_MESSAGE(field, field.error());
  REQUIRE(field->half_count() > 0);
  REQUIRE(field->quarter_count() > 0);
  return *field;
}

template <class Array>
bool same(const Array& a, const Array& b) {
  return a.size() == b.size() &&
         (a.empty() || !std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]));
}

inline void check_same(const FieldData& a, const FieldData& b) {
  CHECK(std::memcmp(&a.origin, &b.origin, sizeof a.origin) == 0);
  CHECK(a.voxel_size == b.voxel_size);
  CHECK(a.bricks == b.bricks);
  CHECK(same(a.brick_index, b.brick_index));
  CHECK(same(a.samples, b.samples));
  CHECK(same(a.far_grid, b.far_grid));
  CHECK(same(a.part, b.part));
  CHECK(same(a.triangle, b.triangle));
  CHECK(same(a.refined, b.refined));
  CHECK(same(a.fine_index, b.fine_index));
  CHECK(same(a.halves, b.halves));
  CHECK(same(a.quarters, b.quarters));
  CHECK(a.tolerance == b.tolerance);
  CHECK(a.part_names == b.part_names);
  CHECK(a.band == b.band);
  CHECK(a.offset == b.offset);
  CHECK(a.sign_mode == b.sign_mode);
  CHECK(a.input_hash == b.input_hash);
  CHECK(a.triangles == b.triangles);
}

inline std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
inline void put(const fs::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
}

// Every 16th brick along each axis: many cells of the brick index, few samples.
inline FieldData scattered(int bricks) {
  FieldData f;
  const auto n = std::size_t(bricks);
  f.bricks = {bricks, bricks, bricks};
  f.voxel_size = 1e-3;
  f.band = 3e-3;
  f.brick_index.assign(n * n * n, -1);
  for (std::size_t c = 0; c < f.brick_index.size(); ++c)
    if (c % n % 16 == 5 && c / n % n % 16 == 15 && c / n / n % 16 == 0)
      f.brick_index[c] = std::int32_t(f.samples.size() / 512),
      f.samples.resize(f.samples.size() + 512);
  Random random(3);
  for (float& v : f.samples) v = float(random(-2e-3, 2e-3));
  f.far_grid.resize((n + 1) * (n + 1) * (n + 1));
  for (float& v : f.far_grid) v = float(random(-1, 1));
  for (std::size_t r = 0; r < f.brick_count(); ++r) f.triangle.push_back(std::int32_t(r % 7) - 1);
  f.triangles = 6;
  return f;
}

}  // namespace field_samples
