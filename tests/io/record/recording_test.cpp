// SPDX-License-Identifier: Apache-2.0
// recording_test.cpp - recordings come back to the bit, open in any HDF5 tool, and damaged, foreign
// or forged files are refused with a sentence.
#include "io/record/recording.h"

#include <doctest/doctest.h>
#include <hdf5.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "tests/io/record/recorded_frames.h"

using namespace h6;
using namespace h6::io;
using namespace h6::recorded;

TEST_CASE("every number of a frame, the head, events and summary come back to the bit") {
  const Folder folder;
  for (const std::size_t hands : {1, 2, 8})
    for (const std::size_t count : {0, 1, 249, 250, 251, 1777}) {
      CAPTURE(hands);
      CAPTURE(count);
      const fs::path file = folder / "run.h5";
      auto recorder = start(file, head(hands));
      REQUIRE(add(*recorder, frames(0, count / 3, hands)));
      REQUIRE(recorder->event({0.25, "device lost", "hand 0: \"unplugged\""}));
      REQUIRE(add(*recorder, frames(count / 3, count - count / 3, hands)));
      REQUIRE(recorder->event({0.5, "", ""}));
      REQUIRE(recorder->finish(R"({"verdict":"held"})"));
      CHECK_FALSE(recorder->finish("{}"));
      CHECK_FALSE(add(*recorder, frames(0, 1)));
      const Recording r = read(file);
      CHECK(r.frames.size() == count);
      CHECK(is_prefix(r));
      CHECK(r.head.scene_json == head().scene_json);
      CHECK(r.head.asset_hashes == head().asset_hashes);
      CHECK(r.head.simd_target == "AVX3");
      CHECK(r.head.program == "hapsix 0.1.0");
      CHECK(r.head.rate == 1000);
      CHECK(r.head.hands == hands);
      REQUIRE(r.events.size() == 2);
      CHECK(r.events[0].time == 0.25);
      CHECK(r.events[0].what == "device lost");
      CHECK(r.events[0].detail == "hand 0: \"unplugged\"");
      CHECK(r.events[1].what == "");
      CHECK(r.summary_json == R"({"verdict":"held"})");
      CHECK(r.whole);
      CHECK(r.remark.empty());
      CHECK(folder.files() == 1);  // nothing is left beside it
    }
}

TEST_CASE("a part of a recording is the same frames as in the whole") {
  const Folder folder;
  record(folder / "run.h5", 1000);
  const Result<Recording> part = read_recording(folder / "run.h5", {700, 100});
  REQUIRE(part);
  REQUIRE(part->frames.size() == 100);
  CHECK(part->frame_count == 1000);
  for (std::size_t i = 0; i < 100; ++i) CHECK(same(part->frames[i], frame(700 + i)));
  CHECK(read_recording(folder / "run.h5", {5000, 10})->frames.empty());
  CHECK(read_recording(folder / "run.h5", {990, UINT64_MAX})->frames.size() == 10);
}

TEST_CASE("the HDF5 library alone sees the documented datasets") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  record(file, 600, 2);
  using Shape = std::vector<hsize_t>;
  CHECK(plain_shape(file, "/frames/t") == Shape{600});
  CHECK(plain_shape(file, "/frames/hand_pose") == Shape{600, 2, 7});
  CHECK(plain_shape(file, "/frames/hand_velocity") == Shape{600, 2, 6});
  CHECK(plain_shape(file, "/frames/body_pose") == Shape{600, 2, 7});
  CHECK(plain_shape(file, "/frames/wrench") == Shape{600, 2, 6});
  for (const char* safety : {"cause", "causes", "state", "safety_asked", "overdue"})
    CHECK(plain_shape(file, (std::string("/frames/") + safety).c_str()) == Shape{600, 2});
  CHECK(plain_shape(file, "/frames/settings") == Shape{600});
  CHECK(plain_shape(file, "/frames/hand_wrench") == Shape{600, 2, 6});
  CHECK(plain_shape(file, "/frames/command_pose") == Shape{600, 2, 7});
  CHECK(plain_shape(file, "/frames/net_stiffness") == Shape{600, 2});
  CHECK(plain_shape(file, "/frames/stage_us") == Shape{600, H6_STAGE_COUNT});
  CHECK(plain_shape(file, "/frames/hash") == Shape{600});
  CHECK(plain_shape(file, "/events/t") == Shape{0});

  // The order inside a row is position, then the quaternion with w first. Units are attributes.
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t data = H5Dopen2(h5, "/frames/hand_pose", H5P_DEFAULT);
  std::vector<double> poses(600 * 2 * 7);
  REQUIRE(H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, poses.data()) >= 0);
  const h6FrameRecord f = frame(321, 2);
  const double* row = poses.data() + (321 * 2 + 1) * 7;
  CHECK(std::memcmp(&row[0], &f.hand[1].pose.p.x, 8) == 0);
  CHECK(std::memcmp(&row[3], &f.hand[1].pose.q.w, 8) == 0);
  CHECK(std::memcmp(&row[6], &f.hand[1].pose.q.z, 8) == 0);
  CHECK(H5Aexists(data, "units") > 0);
  H5Dclose(data);
  H5Fclose(h5);
}

TEST_CASE("a recording from before a column was added opens, with zeros in its place") {
  const Folder folder;
  const fs::path file = folder / "run.h5";
  record(file, 300);
  const std::vector<std::string> all = read(file).columns;
  CHECK(std::count(all.begin(), all.end(), "hand_wrench") == 1);
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const char* later[] = {"hand_wrench", "command_pose", "net_stiffness", "causes",   "state",
                         "sequence",    "safety_asked", "overdue",       "settings", "substeps"};
  for (const char* name : later)
    REQUIRE(H5Ldelete(h5, (std::string("/frames/") + name).c_str(), H5P_DEFAULT) >= 0);
  H5Fclose(h5);
  const Recording r = read(file);
  REQUIRE(r.frames.size() == 300);
  CHECK(r.columns.size() + std::size(later) == all.size());
  for (const char* name : later) CHECK(std::count(r.columns.begin(), r.columns.end(), name) == 0);
  for (std::size_t i = 0; i < 300; ++i) {
    h6FrameRecord expected = frame(i);
    expected.hand[0].wrench = {};
    expected.command[0].pose = {};
    expected.command[0].causes = 0;
    expected.state[0] = H6_ABSENT;
    expected.hand[0].sequence = 0;
    expected.safety_input[0] = {};
    expected.settings = 0;
    expected.report.substeps = 0;
    expected.report.net_stiffness_min = expected.report.net_stiffness_max = 0;
    REQUIRE(same(r.frames[i], expected));
  }
}

TEST_CASE("a file that is not a recording is not replaced, and impossible heads are refused") {
  const Folder folder;
  const fs::path text = folder / "part.stl";
  write_bytes(text, std::vector<char>(100, 's'), 100);
  const auto refused = [](const fs::path& file, const RecordingHead& h = head()) {
    const auto made = Recorder::create(file, h);
    return made ? std::string() : made.error();
  };
  CHECK(mentions(refused(text), "not a recording"));
  CHECK(bytes_of(text) == std::vector<char>(100, 's'));
  CHECK(mentions(refused(folder.path), "folder"));
  CHECK(mentions(refused(folder / "none/run.h5"), "does not exist"));
  CHECK(mentions(refused("/dev/full"), "ordinary"));
  CHECK(mentions(refused(folder / "a.h5", head(0)), "hands"));
  CHECK(mentions(refused(folder / "a.h5", head(9)), "hands"));
  CHECK(mentions(refused(folder / "a.h5", head(1, -1)), "rate"));
  RecordingHead bad = head();
  bad.scene_json = "{";
  CHECK(mentions(refused(folder / "a.h5", bad), "JSON"));
  CHECK(folder.files() == 1);
}

TEST_CASE("files that are missing, foreign, cut off or damaged are refused with a sentence") {
  const Folder folder;
  CHECK(mentions(refusal(folder / "none.h5"), "no such file"));
  CHECK(mentions(refusal(folder.path), "ordinary"));
  write_bytes(folder / "text.h5", std::vector<char>(5000, 'x'), 5000);
  CHECK(mentions(refusal(folder / "text.h5"), "not an HDF5 file"));
  const hid_t h5 =
      H5Fcreate((folder / "other.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  H5Fclose(h5);
  CHECK(mentions(refusal(folder / "other.h5"), "/config"));

  record(folder / "run.h5", 300);
  const std::vector<char> good = bytes_of(folder / "run.h5");
  const fs::path cut = folder / "cut.h5";
  for (std::size_t size = 0; size < good.size(); size += 1 + good.size() / 97) {
    write_bytes(cut, good, size);
    CHECK_FALSE(refusal(cut).empty());
    CHECK(repair_recording(cut)->empty());  // it repairs logs, and changes nothing else
  }
}

TEST_CASE("false sizes and wrong shapes and types are refused before memory is taken") {
  const Folder folder;
  record(folder / "run.h5", 300);
  const auto change = [&](auto&& edit) {
    const fs::path file = folder / "edited.h5";
    fs::copy_file(folder / "run.h5", file, fs::copy_options::overwrite_existing);
    const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    edit(h5);
    H5Fclose(h5);
    return refusal(file);
  };
  const auto grow = [](hid_t h5, const char* name, std::vector<hsize_t> dims) {
    const hid_t data = H5Dopen2(h5, name, H5P_DEFAULT);
    REQUIRE(H5Dset_extent(data, dims.data()) >= 0);
    H5Dclose(data);
  };
  const auto replace = [](hid_t h5, const char* name, hid_t type, std::vector<hsize_t> dims) {
    H5Ldelete(h5, name, H5P_DEFAULT);
    const hid_t space = H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr);
    H5Dclose(H5Dcreate2(h5, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    H5Sclose(space);
  };
  CHECK(change([](hid_t) {}).empty());
  for (const hsize_t rows : {hsize_t{301}, hsize_t{100000}, hsize_t{1} << 40, hsize_t{1} << 62})
    CHECK_FALSE(change([&](hid_t h5) {
                  for (const char* name : {"/frames/t", "/frames/hash", "/frames/status"})
                    grow(h5, name, {rows});
                }).empty());
  CHECK(mentions(change([&](hid_t h5) { grow(h5, "/frames/late", {299}); }), "299 rows"));
  CHECK(mentions(change([&](hid_t h5) { grow(h5, "/events/t", {hsize_t{1} << 50}); }), "/events"));
  CHECK(mentions(change([](hid_t h5) { H5Ldelete(h5, "/frames/wrench", H5P_DEFAULT); }),
                 "/frames/wrench is missing"));
  CHECK(mentions(change([&](hid_t h5) {
                   replace(h5, "/frames/net_stiffness", H5T_IEEE_F64LE, {0, 3});
                 }),
                 "shape"));
  CHECK(mentions(change([](hid_t h5) { H5Ldelete(h5, "/config/whole", H5P_DEFAULT); }),
                 "/config/whole is missing"));
  CHECK(mentions(change([](hid_t h5) { H5Ldelete(h5, "/events", H5P_DEFAULT); }),
                 "/events is missing"));
  CHECK(mentions(change([&](hid_t h5) { replace(h5, "/frames/t", H5T_STD_I8LE, {300}); }), "type"));
  CHECK(mentions(change([&](hid_t h5) {
                   replace(h5, "/frames/t", H5T_IEEE_F64LE, {0, 2});
                 }),
                 "shape"));
  CHECK(mentions(change([&](hid_t h5) { replace(h5, "/frames/t", H5T_IEEE_F64LE, {}); }), "shape"));
  CHECK(mentions(change([&](hid_t h5) { replace(h5, "/frames/t", H5T_IEEE_F64LE, {300}); }),
                 "than are stored"));
  // Chunks that do not fit their filters: too short, not deflated, too long.
  for (const std::uint32_t mask : {0u, 1u, 2u, 3u})
    for (const std::size_t size : {1, 10, 2000, 2001}) {
      CAPTURE(mask);
      CAPTURE(size);
      CHECK((mask >= 2 && size == 2000) ==
            change([&](hid_t h5) {
              const hid_t data = H5Dopen2(h5, "/frames/t", H5P_DEFAULT);
              const std::vector<char> junk(size, 'j');
              const hsize_t first = 0;
              REQUIRE(H5Dwrite_chunk(data, H5P_DEFAULT, mask, &first, size, junk.data()) >= 0);
              H5Dclose(data);
            }).empty());
    }
  CHECK(mentions(change([](hid_t h5) {
                   const hid_t data = H5Dopen2(h5, "/frames/cause", H5P_DEFAULT);
                   const std::vector<std::uint32_t> odd(300, 4000000000u);
                   H5Dwrite(data, H5T_NATIVE_UINT32, H5S_ALL, H5S_ALL, H5P_DEFAULT, odd.data());
                   H5Dclose(data);
                 }),
                 "cause"));
}
