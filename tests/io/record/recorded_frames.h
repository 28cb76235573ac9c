// SPDX-License-Identifier: Apache-2.0
// recorded_frames.h - frames with arbitrary bits, a folder, short ways to record and to read.
#pragma once
#include <doctest/doctest.h>
#include <hdf5.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "io/record/recording.h"

namespace h6::recorded {

using namespace h6::io;
namespace fs = std::filesystem;

// A folder of its own, gone at the end of the scope.
struct Folder {
  fs::path path;
  Folder() {
    static int serial = 0;
    path = fs::temp_directory_path() /
           ("hapsix-recording-" + std::to_string(::getpid()) + "-" + std::to_string(++serial));
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  fs::path operator/(const char* name) const { return path / name; }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(path), fs::directory_iterator()));
  }
};

// Bits that depend only on these two numbers (splitmix64).
inline std::uint64_t bits(std::uint64_t frame, std::uint64_t cell) {
  std::uint64_t z = frame * 1000 + cell + 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

// Frame i of every run: each number has its own arbitrary bits, NaN included.
inline h6FrameRecord frame(std::uint64_t i, std::size_t hands = 1, double rate = 1000) {
  h6FrameRecord r;
  std::memset(static_cast<void*>(&r), 0, sizeof r);
  std::uint64_t cell = 0;
  const auto fill = [&](void* at, std::size_t numbers) {
    for (std::size_t k = 0; k < numbers; ++k) {
      const std::uint64_t value = bits(i, ++cell);
      std::memcpy(static_cast<char*>(at) + 8 * k, &value, 8);
    }
  };
  const auto natural = [&] { return static_cast<std::uint32_t>(bits(i, ++cell)); };
  r.time = static_cast<double>(i) / rate;
  r.report.frame = i;
  r.report.status = natural();
  r.report.contacts = natural();
  fill(&r.report.max_depth, 1);
  fill(&r.report.max_depth_voxels, 1);
  fill(&r.report.net_stiffness_min, 1);
  fill(&r.report.net_stiffness_max, 1);
  fill(r.report.stage_us, H6_STAGE_COUNT);
  fill(&r.report.frame_us, 1);
  fill(&r.report.state_hash, 1);
  fill(&r.wakeup_us, 1);
  r.late = natural();
  fill(&r.late_us, 1);
  fill(&r.cpu_us, 1);
  r.report.coarse_pairs = natural();
  r.report.coarse_points = natural();
  r.report.substeps = natural();
  r.settings = natural();
  fill(&r.report.missed_depth_voxels, 1);
  for (std::size_t h = 0; h < hands; ++h) {
    fill(&r.hand[h].pose, 7);
    fill(&r.hand[h].velocity, 6);
    fill(&r.hand[h].wrench, 6);
    r.hand[h].buttons = natural();
    fill(&r.command[h].wrench, 6);
    fill(&r.command[h].pose, 7);
    r.command[h].cause = static_cast<h6Cause>(natural() % H6_CAUSE_COUNT);
    r.command[h].causes = natural() >> (32 - H6_CAUSE_COUNT);
    r.state[h] = static_cast<h6DeviceState>(natural() % H6_DEVICE_STATE_COUNT);
    r.hand[h].sequence = natural();
    r.safety_input[h].asked = (natural() & 0xffu) | (natural() % H6_CAUSE_COUNT) << 8;
    fill(&r.safety_input[h].overdue, 1);
    fill(&r.body[h], 13);
  }
  return r;
}

inline bool same(const h6FrameRecord& a, const h6FrameRecord& b) {
  const auto equal = [](const auto& x, const auto& y) { return !std::memcmp(&x, &y, sizeof x); };
  bool all =
      equal(a.time, b.time) && equal(a.wakeup_us, b.wakeup_us) && a.late == b.late &&
      equal(a.late_us, b.late_us) && equal(a.cpu_us, b.cpu_us) &&
      a.report.coarse_pairs == b.report.coarse_pairs &&
      a.report.coarse_points == b.report.coarse_points && a.report.substeps == b.report.substeps &&
      a.settings == b.settings &&
      equal(a.report.missed_depth_voxels, b.report.missed_depth_voxels) &&
      a.report.frame == b.report.frame && a.report.status == b.report.status &&
      a.report.contacts == b.report.contacts && equal(a.report.max_depth, b.report.max_depth) &&
      equal(a.report.max_depth_voxels, b.report.max_depth_voxels) &&
      equal(a.report.net_stiffness_min, b.report.net_stiffness_min) &&
      equal(a.report.net_stiffness_max, b.report.net_stiffness_max) &&
      equal(a.report.stage_us, b.report.stage_us) && equal(a.report.frame_us, b.report.frame_us) &&
      a.report.state_hash == b.report.state_hash;
  for (std::size_t h = 0; h < H6_MAX_HANDS; ++h)
    all = all && equal(a.hand[h].pose, b.hand[h].pose) &&
          equal(a.hand[h].velocity, b.hand[h].velocity) &&
          equal(a.hand[h].wrench, b.hand[h].wrench) && a.hand[h].buttons == b.hand[h].buttons &&
          equal(a.body[h], b.body[h]) && equal(a.command[h].wrench, b.command[h].wrench) &&
          equal(a.command[h].pose, b.command[h].pose) && a.command[h].cause == b.command[h].cause &&
          a.command[h].causes == b.command[h].causes && a.state[h] == b.state[h] &&
          a.hand[h].sequence == b.hand[h].sequence &&
          a.safety_input[h].asked == b.safety_input[h].asked &&
          equal(a.safety_input[h].overdue, b.safety_input[h].overdue);
  return all;
}

inline bool is_prefix(const Recording& r) {
  for (std::size_t i = 0; i < r.frames.size(); ++i)
    if (!same(r.frames[i], frame(i, r.head.hands, r.head.rate))) return false;
  return true;
}

inline RecordingHead head(std::size_t hands = 1, double rate = 1000) {
  RecordingHead h;
  h.scene_json = R"({"hapsix":1,"about":"Prüfstück"})";
  h.asset_hashes = {"00ff", "", "abcdef"};
  h.simd_target = "AVX3";
  h.program = "hapsix 0.1.0";
  h.rate = rate;
  h.hands = hands;
  return h;
}

inline std::vector<h6FrameRecord> frames(std::uint64_t first, std::size_t count,
                                         std::size_t hands = 1, double rate = 1000) {
  std::vector<h6FrameRecord> all;
  for (std::size_t i = 0; i < count; ++i) all.push_back(frame(first + i, hands, rate));
  return all;
}

inline std::unique_ptr<Recorder> start(const fs::path& file, const RecordingHead& h = head()) {
  Result<std::unique_ptr<Recorder>> made = Recorder::create(file, h);
  if (!made) FAIL(made.error());
  return std::move(*made);
}

inline bool add(Recorder& recorder, const std::vector<h6FrameRecord>& all) {
  return static_cast<bool>(recorder.frames(all.data(), all.size()));
}

inline void record(const fs::path& file, std::size_t count, std::size_t hands = 1,
                   double rate = 1000) {
  auto recorder = start(file, head(hands, rate));
  REQUIRE(add(*recorder, frames(0, count, hands, rate)));
  REQUIRE(recorder->finish(R"({"frames":1})"));
}

inline Recording read(const fs::path& file) {
  Result<Recording> r = read_recording(file);
  if (!r) FAIL(r.error());
  return std::move(*r);
}

inline std::string refusal(const fs::path& file) {
  const Result<Recording> r = read_recording(file);
  return r ? "" : r.error();
}

inline bool mentions(const std::string& sentence, const char* what) {
  INFO(sentence);
  return sentence.find(what) != std::string::npos;
}

inline std::vector<char> bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline void write_bytes(const fs::path& file, const std::vector<char>& bytes, std::size_t count) {
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(count));
}

// The shape of a dataset as any HDF5 tool sees it; empty when the file does not open.
inline std::vector<hsize_t> plain_shape(const fs::path& file, const char* dataset) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const hid_t h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  if (h5 < 0) return {};
  std::vector<hsize_t> dims;
  const hid_t data = H5Dopen2(h5, dataset, H5P_DEFAULT);
  if (data >= 0) {
    const hid_t space = H5Dget_space(data);
    dims.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
    H5Sget_simple_extent_dims(space, dims.data(), nullptr);
    H5Sclose(space);
    H5Dclose(data);
  }
  H5Fclose(h5);
  return dims;
}

}  // namespace h6::recorded
