// SPDX-License-Identifier: Apache-2.0
// field_file_test.cpp - .vdb files: to the bit and back, for other programs, and with every kind of
// damage.
#include <doctest/doctest.h>
#include "tests/support/near.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "io/field/field_file.h"
#include "tests/io/field/field_samples.h"
#include "tests/support/sanitized.h"

// OpenVDB allocates by the length of a compressed block. read_field catches the bad_alloc of a
// damaged length, but AddressSanitizer ends the program instead of throwing.
constexpr bool kHugeAllocationsThrow = !h6::test::kAddressSanitized;

using namespace field_samples;
using namespace h6::io;
namespace fs = std::filesystem;

namespace {

std::string error_of(const fs::path& file) {
  const auto field = read_field(file);
  return field ? "" : field.error();
}

openvdb::GridPtrVec read_with_openvdb(const fs::path& file) {
  openvdb::initialize();
  openvdb::io::File in(file.string());
  in.open(/*delayLoad=*/false);
  openvdb::GridPtrVec grids = *in.getGrids();
  in.close();
  return grids;
}

}  // namespace

TEST_CASE("field_file: a field comes back to the bit, compressed or not") {
  const Folder folder;
  FieldData field = baked();
  REQUIRE(field.part.size() == field.brick_count());
  field.samples[7] = -0.0f;
  field.far_grid[3] = -0.0f;
  field.far_grid[4] = float(field.band);
  const FieldData finer = refined();
  for (Compression c : {Compression::none, Compression::blosc}) {
    for (const FieldData* f : {&std::as_const(field), &finer}) {
      const fs::path file = folder.path / "field.vdb";
      const h6::Outcome written = write_field(file, *f, c);
      REQUIRE_MESSAGE(written, written.error());
      const auto back = read_field(file);
      REQUIRE_MESSAGE(back, back.error());
      check_same(*f, *back);
      CHECK(folder.files() == 1);
    }
  }
}

TEST_CASE("field_file: a finer sample that is missing, not finite or of no brick is damage") {
  const Folder folder;
  const fs::path file = folder.path / "field.vdb";
  const FieldData field = refined();
  FieldData infinite = field;
  infinite.quarters[62] = HUGE_VALF;  // in the middle of a cell, so of that cell alone
  REQUIRE(write_field(file, infinite));
  CHECK(error_of(file).find("damaged") != std::string::npos);
  for (const char* missing : {"distance_2", "distance_4"}) {
    REQUIRE(write_field(file, field));
    openvdb::GridPtrVec grids = read_with_openvdb(file);
    std::erase_if(grids, [&](const auto& grid) { return grid->getName() == missing; });
    openvdb::io::File(file.string()).write(grids);
    CHECK(error_of(file).find("damaged") != std::string::npos);
  }
}

TEST_CASE("field_file: a field of another version of the format is refused, and says so") {
  const Folder folder;
  const fs::path file = folder.path / "field.vdb";
  for (Compression c : {Compression::none, Compression::blosc}) {
    REQUIRE(write_field(file, baked(), c));
    std::string bytes = bytes_of(file);
    // Name, type "int32" and length 4 come before the number.
    const std::size_t at = bytes.find("hapsix_format") + 13 + 4 + 5 + 4;
    REQUIRE(bytes[at] == 3);
    for (const char version : {1, 2, 77}) {
      bytes[at] = version;
      put(file, bytes);
      CHECK(error_of(file).find("another version of hapsix: bake it again") != std::string::npos);
    }
  }
  // The same file as written by a program that does not know the checksum.
  REQUIRE(write_field(file, baked(), Compression::none));
  const openvdb::GridPtrVec grids = read_with_openvdb(file);
  for (const auto& grid : grids)
    if (grid->getName() == "distance") grid->insertMeta("hapsix_format", openvdb::Int32Metadata(2));
  openvdb::io::File out(file.string());
  out.write(grids);
  out.close();
  CHECK(error_of(file).find("another version of hapsix: bake it again") != std::string::npos);
}

TEST_CASE("field_file: names that the mesh does not have make a field damaged") {
  const Folder folder;
  const fs::path file = folder.path / "field.vdb";
  const FieldData field = baked();
  REQUIRE(field.triangle.size() == field.brick_count());
  for (Compression c : {Compression::none, Compression::blosc}) {
    for (const std::int32_t bad : {std::int32_t(field.triangles), -2, 1 << 30}) {
      FieldData broken = field;
      broken.triangle[field.brick_count() / 2] = bad;
      REQUIRE(write_field(file, broken, c));
      CHECK(error_of(file).find("damaged") != std::string::npos);
    }
    for (const std::int32_t bad : {2, -1}) {
      FieldData broken = field;
      broken.part[field.brick_count() / 2] = bad;
      REQUIRE(write_field(file, broken, c));
      CHECK(error_of(file).find("damaged") != std::string::npos);
    }
    FieldData infinite = field;
    infinite.samples[512 * 3 + 77] = HUGE_VALF;
    REQUIRE(write_field(file, infinite, c));
    CHECK(error_of(file).find("damaged") != std::string::npos);
  }
}

TEST_CASE("field_file: OpenVDB's own reader sees a level set in world units") {
  const Folder folder;
  const FieldData field = baked();
  const fs::path file = folder.path / "field.vdb";
  REQUIRE(write_field(file, field));
  openvdb::initialize();
  openvdb::io::File in(file.string());
  in.open();
  const auto grid = openvdb::gridPtrCast<openvdb::FloatGrid>(in.readGrid("distance"));
  REQUIRE(grid);
  CHECK(grid->getGridClass() == openvdb::GRID_LEVEL_SET);
  CHECK(grid->tree().leafCount() == field.brick_count());
  CHECK(grid->activeVoxelCount() == 512 * field.brick_count());
  CHECK(grid->transform().isLinear());
  CHECK(grid->voxelSize().x() == h6::test::near(field.voxel_size));  // [m]
  CHECK(grid->voxelSize().z() == h6::test::near(field.voxel_size));
  // The background is the half width of the band, so that programs that clip at the background, as
  // OpenVDB's own tools do, draw the surface and nothing else.
  CHECK(grid->background() == h6::test::near(field.band).epsilon(1e-6));
  std::size_t band = 0, missing = 0;
  for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf)
    for (auto value = leaf->cbeginValueAll(); value; ++value) {
      band += std::fabs(*value) < field.band;
      missing += std::fabs(*value) < field.band && !value.isValueOn();
    }
  CHECK(band > 1000);
  CHECK(missing == 0);
  const Vec3 p = node_position(field, {20, 21, 22});
  const openvdb::Vec3d at = grid->worldToIndex(openvdb::Vec3d(p.x, p.y, p.z));
  CHECK(at.x() == h6::test::near(20));
  CHECK(at.z() == h6::test::near(22));
  if (const float* d = node_sample(field, {20, 21, 22}))
    CHECK(grid->tree().getValue(openvdb::Coord(20, 21, 22)) == *d);
  CHECK(in.readGrid("far"));
}

TEST_CASE("field_file: a truncated or damaged file is a sentence or a field, never more") {
  const Folder folder;
  const fs::path file = folder.path / "field.vdb";
  const FieldData field = baked();
  for (Compression c : {Compression::none, Compression::blosc}) {
    REQUIRE(write_field(file, field, c));
    const std::string whole = bytes_of(file);
    for (std::size_t part = 0; part < 60; ++part) {
      const std::size_t size = part < 30 ? part * 20 : whole.size() * (part - 29) / 31;
      if (size >= whole.size()) continue;
      put(file, whole.substr(0, size));
      const auto back = read_field(file);
      REQUIRE_FALSE(back);
      CHECK(back.error().find(file.string()) != std::string::npos);
    }
    if (!kHugeAllocationsThrow) continue;
    Random random(9);
    std::size_t refused = 0;
    for (int i = 0; i < 250; ++i) {
      std::string bad = whole;
      const std::size_t reach = i % 2 ? bad.size() : 2500;  // the head more often
      for (int flips = 0; flips < 4; ++flips) bad[random.below(reach)] = char(random.below(256));
      put(file, bad);
      refused += !read_field(file);
    }
    CHECK(refused > 50);
  }
}

TEST_CASE("field_file: one flipped bit anywhere in our own file is noticed") {
  const Folder folder;
  const fs::path file = folder.path / "field.vdb";
  for (Compression c : {Compression::none, Compression::blosc}) {
    REQUIRE(write_field(file, baked(), c));
    const std::string whole = bytes_of(file);
    Random random(5);
    std::size_t by_checksum = 0;
    for (int i = 0; i < 200; ++i) {
      std::string bad = whole;
      bad[4096 + random.below(bad.size() - 4096)] ^= char(1 << random.below(8));
      put(file, bad);
      const auto back = read_field(file);
      REQUIRE_FALSE(back);
      CHECK(back.error().find("damaged") != std::string::npos);
      by_checksum += back.error().find("checksum") != std::string::npos;
    }
    CHECK(by_checksum > 190);  // the rest are lengths that no file could have
  }
}

TEST_CASE("field_file: fields with voxels of a micrometre can be written and come back") {
  const Folder folder;
  const fs::path file = folder.path / "small.vdb";
  FieldData field = baked();
  const double scale = 1e-6 / field.voxel_size;
  field.voxel_size = 1e-6;
  field.band *= scale;
  for (double* v : {&field.origin.x, &field.origin.y, &field.origin.z}) *v *= scale;
  for (float& v : field.samples) v *= float(scale);
  for (float& v : field.far_grid) v *= float(scale);
  const auto written = write_field(file, field, Compression::none);
  REQUIRE_MESSAGE(written, written.error());
  const auto back = read_field(file);
  REQUIRE_MESSAGE(back, back.error());
  check_same(field, *back);
}

TEST_CASE("field_file: lengths that no file could have are refused before anything is allocated") {
  const Folder folder;
  const fs::path file = folder.path / "field.vdb";
  REQUIRE(write_field(file, baked(), Compression::none));
  const std::string whole = bytes_of(file);
  const std::size_t at = whole.find("hapsix_sign_mode");
  REQUIRE(at != std::string::npos);
  for (std::size_t back : {4u, 0u}) {
    std::string bad = whole;
    const std::size_t place = back ? at - back : whole.find("closed") - 4;
    std::memcpy(&bad[place], "\xf0\xff\xff\xff", 4);
    put(file, bad);
    rusage before, after;
    getrusage(RUSAGE_SELF, &before);
    CHECK_FALSE(read_field(file));
    getrusage(RUSAGE_SELF, &after);
    CHECK(after.ru_maxrss - before.ru_maxrss < 100 * 1024);
  }
}

TEST_CASE("field_file: other files and missing files say what they are") {
  const Folder folder;
  const auto fails = [&](const fs::path& file, const std::string& about) {
    const auto field = read_field(file);
    REQUIRE_FALSE(field);
    INFO(field.error());
    CHECK(field.error().find(about) != std::string::npos);
  };
  fails(folder.path / "none.vdb", "no file");
  fails(folder.path, "no file");
  put(folder.path / "text.vdb", "this is not a field, but it is long enough to be looked at twice");
  fails(folder.path / "text.vdb", "no OpenVDB file");
  put(folder.path / "empty.vdb", "");
  fails(folder.path / "empty.vdb", "no OpenVDB file");
  openvdb::initialize();
  const auto two = [&](const openvdb::GridPtrVec& grids) {
    openvdb::io::File out((folder.path / "other.vdb").string());
    out.write(grids);
    out.close();
  };
  two({openvdb::Vec3SGrid::create()});
  fails(folder.path / "other.vdb", "one float level set");
  two({openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {0, 0, 0}, 0.1f, 3),
       openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {0, 0, 0}, 0.1f, 3)});
  fails(folder.path / "other.vdb", "one float level set");
  two({openvdb::createLevelSet<openvdb::FloatGrid>(0.1)});
  fails(folder.path / "other.vdb", "empty");
  two({openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {0, 0, 0}, 0.1f, 1.5f)});
  fails(folder.path / "other.vdb", "narrow");
}

TEST_CASE("field_file: a level set of another program becomes a field with safe bounds") {
  const Folder folder;
  openvdb::initialize();
  const double h = 0.05, radius = 1.0;
  const openvdb::Vec3f middle(0.3f, -0.2f, 5.0f);
  const auto grid =
      openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(float(radius), middle, float(h), 4);
  openvdb::io::File out((folder.path / "sphere.vdb").string());
  out.write(openvdb::GridPtrVec{grid});
  out.close();
  const auto field = read_field(folder.path / "sphere.vdb");
  REQUIRE_MESSAGE(field, field.error());
  CHECK(field->voxel_size == h6::test::near(h));
  const auto truth = [&](Vec3 p) { return norm(p - Vec3{0.3, -0.2, 5.0}) - radius; };
  std::size_t wrong = 0, too_long = 0, missing = 0, at = 0;
  for_nodes(*field, [&](std::array<int, 3> n, double d) {
    const double t = truth(node_position(*field, n));
    wrong += std::fabs(t) < field->band && std::fabs(d - t) > 1e-3 * h;
    too_long += std::fabs(d) > std::fabs(t) + 1e-3 * h;
  });
  double tightest = 0, loosest = 0;
  for (int c = 0; c <= field->bricks[2]; ++c)
    for (int b = 0; b <= field->bricks[1]; ++b)
      for (int a = 0; a <= field->bricks[0]; ++a, ++at) {
        const double t = truth(node_position(*field, {8 * a, 8 * b, 8 * c}));
        const double d = field->far_grid[at];
        too_long += std::fabs(d) > std::fabs(t) + 1e-3 * h;
        tightest = std::max(tightest, std::fabs(d));
        loosest = std::max(loosest, std::fabs(t) - std::fabs(d));
        if (std::fabs(t) > h) wrong += (d < 0) != (t < 0);
      }
  Random random(2);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = {0.3 + random(-1.3, 1.3), -0.2 + random(-1.3, 1.3), 5 + random(-1.3, 1.3)};
    double value;
    if (std::fabs(truth(p)) < field->band) missing += !interpolate(*field, p, value);
  }
  CHECK(at == field->far_grid.size());
  CHECK(wrong == 0);
  CHECK(too_long == 0);
  CHECK(missing == 0);
  CHECK(tightest > field->band);
  CHECK(loosest < 1.8 * h);
}

TEST_CASE("field_file: what cannot be written leaves nothing behind") {
  const Folder folder;
  const FieldData field = baked();
  CHECK_FALSE(write_field(folder.path / "no" / "such" / "folder.vdb", field));
  FieldData broken = field;
  broken.far_grid.pop_back();
  CHECK_FALSE(write_field(folder.path / "broken.vdb", broken));
  broken = field;
  broken.brick_index[0] = 1 << 30;
  CHECK_FALSE(write_field(folder.path / "broken.vdb", broken));
  CHECK(folder.files() == 0);
  // A disk that is full after 100 kB.
  rlimit old;
  getrlimit(RLIMIT_FSIZE, &old);
  rlimit small = old;
  small.rlim_cur = 100 * 1024;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  const h6::Outcome full = write_field(folder.path / "full.vdb", field, Compression::none);
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  CHECK_FALSE(full);
  CHECK(folder.files() == 0);
}
