// SPDX-License-Identifier: Apache-2.0
// raw_field_test.cpp - fields of the cache: to the bit and back, and with every kind of damage.
#include <doctest/doctest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <string>
#include <utility>

#include "io/field/raw_field.h"
#include "tests/io/field/field_samples.h"

using namespace field_samples;

namespace {

constexpr std::size_t kPage = 4096, kBlock = std::size_t{4} << 20;

std::string error_of(const fs::path& file) {
  const auto field = read_raw_field(file);
  return field ? "" : field.error();
}

}  // namespace

TEST_CASE("raw_field: fields of one block, of many and of none come back to the bit") {
  const Folder folder;
  const fs::path file = folder.path / "a.field";
  FieldData odd = baked();
  REQUIRE(odd.part.size() == odd.brick_count());
  odd.samples[7] = -0.0f;
  odd.far_grid[3] = -0.0f;
  const FieldData none = scattered(1);
  REQUIRE(none.brick_count() == 0);
  const FieldData large = baked(256);
  REQUIRE(large.samples.size() * sizeof(float) > 2 * kBlock);
  const FieldData wide = scattered(112);
  REQUIRE(wide.brick_index.size() * sizeof(std::int32_t) > kBlock);
  const FieldData finer = refined();
  for (const FieldData* field : {&std::as_const(odd), &none, &large, &wide, &finer}) {
    const h6::Outcome written = write_raw_field(file, *field);
    REQUIRE_MESSAGE(written, written.error());
    const auto back = read_raw_field(file);
    REQUIRE_MESSAGE(back, back.error());
    check_same(*field, *back);
    CHECK(folder.files() == 1);
  }
}

TEST_CASE("raw_field: a field that was read outlives its file, and changes to it stay its own") {
  const Folder folder;
  const fs::path file = folder.path / "a.field";
  FieldData field = refined();
  REQUIRE(write_raw_field(file, field));
  const std::string bytes = bytes_of(file);
  auto back = read_raw_field(file);
  REQUIRE(back);
  const FieldData copy = *back;
  back->samples[5] = field.samples[5] = 3;
  back->far_grid[1] = field.far_grid[1] = 4;
  back->quarters.resize(field.quarters.size() + 125, 1);
  field.quarters.resize(field.quarters.size() + 125, 1);
  CHECK(bytes_of(file) == bytes);
  REQUIRE(write_raw_field(file, scattered(1)));
  const FieldData moved = std::move(*back);
  check_same(moved, field);
  CHECK(copy.samples[5] != 3);
  fs::remove(file);
  FieldData other = copy;
  other = moved;
  check_same(other, field);
}

#ifdef __linux__
TEST_CASE("raw_field: reading a field copies no samples") {
  const Folder folder;
  const fs::path file = folder.path / "a.field";
  REQUIRE(write_raw_field(file, baked(256)));
  const auto own_kilobytes = [] {
    const std::string status = bytes_of("/proc/self/status");
    return std::stol(status.substr(status.find("RssAnon:") + 8));
  };
  const long before = own_kilobytes();
  const auto back = read_raw_field(file);
  REQUIRE(back);
  const long samples = long(back->samples.size() * sizeof(float) / 1024);
  CHECK(own_kilobytes() - before < samples / 2);
}
#endif

TEST_CASE("raw_field: one flipped bit in the head or any block, and an end anywhere, are noticed") {
  const Folder folder;
  const fs::path file = folder.path / "a.field";
  REQUIRE(write_raw_field(file, scattered(112)));
  std::string bytes = bytes_of(file);
  REQUIRE(bytes.size() > kPage + 2 * kBlock);
  const auto flip = [&](std::size_t at) {
    CAPTURE(at);
    bytes[at] ^= 16;
    put(file, bytes);
    CHECK(error_of(file).find(file.string()) == 0);
    bytes[at] ^= 16;
  };
  const auto cut = [&](std::size_t size) {
    CAPTURE(size);
    put(file, bytes.substr(0, size));
    CHECK(error_of(file).find(file.string()) == 0);
  };
  for (std::size_t at = 0; at < 200; at += 3) flip(at);
  for (const std::size_t size : {0, 1, 100, 4095, 4096}) cut(size);
  flip(kPage - 1);
  for (std::size_t begin = kPage; begin < bytes.size(); begin += kBlock) {
    flip(begin + 300);
    flip(std::min(bytes.size(), begin + kBlock) - 1);
    cut(begin + 1);
  }
  put(file, bytes);
  CHECK(error_of(file).empty());
  put(file, bytes + "x");
  CHECK(error_of(file).find(file.string()) == 0);
}

TEST_CASE("raw_field: sizes that the file does not have are refused before anything is allocated") {
  const Folder folder;
  const fs::path file = folder.path / "a.field";
  REQUIRE(write_raw_field(file, baked()));
  const std::string whole = bytes_of(file);
  for (std::size_t at = 24; at < 128; at += 4) {
    std::string bad = whole;
    bad.replace(at, 4, "\xf0\xff\xff\x7f");
    put(file, bad);
    rusage before, after;
    getrusage(RUSAGE_SELF, &before);
    CHECK_FALSE(read_raw_field(file));
    getrusage(RUSAGE_SELF, &after);
    CHECK(after.ru_maxrss - before.ru_maxrss < 100 * 1024);
  }
}

TEST_CASE(
    "raw_field: files of other kinds, of another version and missing ones say what they are") {
  const Folder folder;
  const fs::path file = folder.path / "a.field";
  put(file, "this is not a field, but it is long enough to be looked at twice");
  CHECK(error_of(file).find("no field of the cache") != std::string::npos);
  put(file, "");
  CHECK(error_of(file).find("no field of the cache") != std::string::npos);
  REQUIRE(write_raw_field(file, baked()));
  std::string bytes = bytes_of(file);
  bytes[bytes.find('\n') - 1] = '7';
  put(file, bytes);
  CHECK(error_of(file).find("another version of hapsix") != std::string::npos);
  CHECK(error_of(folder.path / "none.field").find("No such file") != std::string::npos);
  CHECK(error_of(folder.path).find("Cannot read") == 0);
}

TEST_CASE("raw_field: what cannot be written leaves nothing behind") {
  const Folder folder;
  const FieldData field = baked();
  CHECK_FALSE(write_raw_field(folder.path / "no" / "such" / "a.field", field));
  FieldData broken = field;
  broken.far_grid.pop_back();
  CHECK_FALSE(write_raw_field(folder.path / "a.field", broken));
  broken = field;
  broken.brick_index[0] = 1 << 30;
  CHECK_FALSE(write_raw_field(folder.path / "a.field", broken));
  CHECK(folder.files() == 0);
  // A disk that is full after 100 kB.
  rlimit old;
  getrlimit(RLIMIT_FSIZE, &old);
  rlimit small = old;
  small.rlim_cur = 100 * 1024;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  setrlimit(RLIMIT_FSIZE, &small);
  const h6::Outcome full = write_raw_field(folder.path / "full.field", field);
  setrlimit(RLIMIT_FSIZE, &old);
  std::signal(SIGXFSZ, handler);
  CHECK_FALSE(full);
  CHECK(folder.files() == 0);
}
