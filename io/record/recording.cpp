// SPDX-License-Identifier: Apache-2.0
// recording.cpp - the columns of a recording, the edge to HDF5, and repair after a kill.
#include "io/record/recording.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <system_error>

#include "io/record/copies.h"
#include "io/record/layout.h"

namespace h6::io {
namespace recording {

// Poses, velocities and wrenches are recorded as the doubles they consist of.
static_assert(sizeof(h6Pose) == 7 * sizeof(double) && offsetof(h6Pose, q) == 3 * sizeof(double));
static_assert(sizeof(h6Velocity) == 6 * sizeof(double) && sizeof(h6Wrench) == 6 * sizeof(double));
static_assert(sizeof(h6Cause) == 4 && sizeof(h6Status) == 4 && sizeof(h6DeviceState) == 4);
static_assert(H6_STAGE_COUNT == 7 && H6_CAUSE_COUNT == 20, "names below, format version");
static_assert(offsetof(h6FrameReport, net_stiffness_max) ==
              offsetof(h6FrameReport, net_stiffness_min) + sizeof(double));

const std::vector<Column>& columns() {
  using R = h6FrameRecord;
  constexpr auto report = offsetof(R, report), hand = offsetof(R, hand), body = offsetof(R, body),
                 command = offsetof(R, command), input = offsetof(R, safety_input);
  constexpr auto hands = sizeof(h6DeviceSample), bodies = sizeof(h6BodyState),
                 commands = sizeof(h6DeviceCommand);
  const auto real = Cell::real;
  const auto n32 = Cell::natural32, n64 = Cell::natural64;
  const char* pose = "x y z qw qx qy qz";
  const char* speed = "vx vy vz wx wy wz";
  const char* wrench = "fx fy fz tx ty tz";
  static const std::vector<Column> all = {
      {"t", real, 1, offsetof(R, time), 0, "s", "t"},
      {"hand_pose", real, 7, hand + offsetof(h6DeviceSample, pose), hands, "m, 1", pose},
      {"hand_velocity", real, 6, hand + offsetof(h6DeviceSample, velocity), hands, "m/s, rad/s",
       speed},
      {"buttons", n32, 1, hand + offsetof(h6DeviceSample, buttons), hands, "bits", "buttons"},
      {"hand_wrench", real, 6, hand + offsetof(h6DeviceSample, wrench), hands, "N, N m", wrench,
       true},
      {"body_pose", real, 7, body + offsetof(h6BodyState, pose), bodies, "m, 1", pose},
      {"body_velocity", real, 6, body + offsetof(h6BodyState, velocity), bodies, "m/s, rad/s",
       speed},
      {"wrench", real, 6, command + offsetof(h6DeviceCommand, wrench), commands, "N, N m", wrench},
      {"command_pose", real, 7, command + offsetof(h6DeviceCommand, pose), commands, "m, 1", pose,
       true},
      {"cause", n32, 1, command + offsetof(h6DeviceCommand, cause), commands,
       "index into /config cause_names", "cause"},
      {"causes", n32, 1, command + offsetof(h6DeviceCommand, causes), commands,
       "bits: 1 << index into /config cause_names", "causes", true},
      {"state", n32, 1, offsetof(R, state), sizeof(h6DeviceState), "index into /config state_names",
       "state", true},
      {"sequence", n32, 1, hand + offsetof(h6DeviceSample, sequence), hands, "1", "sequence", true},
      {"safety_asked", n32, 1, input + offsetof(h6SafetyInput, asked), sizeof(h6SafetyInput),
       "bits: 1 arm, 2 disarm, 4 lost, 8 from a fault, 16 from disarmed; fault << 8",
       "safety_asked", true},
      {"overdue", real, 1, input + offsetof(h6SafetyInput, overdue), sizeof(h6SafetyInput), "s",
       "overdue", true},
      {"settings", n32, 1, offsetof(R, settings), 0, "changes so far", "settings", true},
      {"contacts", n32, 1, report + offsetof(h6FrameReport, contacts), 0, "1", "contacts"},
      {"max_depth", real, 1, report + offsetof(h6FrameReport, max_depth), 0, "m", "max_depth"},
      {"max_depth_voxels", real, 1, report + offsetof(h6FrameReport, max_depth_voxels), 0, "voxel",
       "max_depth_voxels"},
      {"net_stiffness", real, 2, report + offsetof(h6FrameReport, net_stiffness_min), 0, "N/m",
       "min max", true},
      {"stage_us", real, H6_STAGE_COUNT, report + offsetof(h6FrameReport, stage_us), 0, "us",
       "traverse contacts weights wrench coupling integrate output"},
      {"frame_us", real, 1, report + offsetof(h6FrameReport, frame_us), 0, "us", "frame_us"},
      {"wakeup_us", real, 1, offsetof(R, wakeup_us), 0, "us", "wakeup_us"},
      {"late", n32, 1, offsetof(R, late), 0, "bits: 1 compute, 2 wakeup, 4 stolen", "late"},
      {"late_us", real, 1, offsetof(R, late_us), 0, "us", "late_us", true},
      {"cpu_us", real, 1, offsetof(R, cpu_us), 0, "us", "cpu_us", true},
      {"coarse_pairs", n32, 1, report + offsetof(h6FrameReport, coarse_pairs), 0, "1",
       "coarse_pairs", true},
      {"coarse_points", n32, 1, report + offsetof(h6FrameReport, coarse_points), 0, "of sixteen",
       "coarse_points", true},
      {"missed_depth_voxels", real, 1, report + offsetof(h6FrameReport, missed_depth_voxels), 0,
       "voxel", "missed_depth_voxels", true},
      {"status", n32, 1, report + offsetof(h6FrameReport, status), 0, "bits of h6Status", "status"},
      {"hash", n64, 1, report + offsetof(h6FrameReport, state_hash), 0, "1", "hash"},
      {"frame", n64, 1, report + offsetof(h6FrameReport, frame), 0, "1", "frame"},
  };
  return all;
}

const std::vector<std::string>& stage_names() {
  static const std::vector<std::string> names = {"traverse", "contacts",  "weights", "wrench",
                                                 "coupling", "integrate", "output"};
  return names;
}

const std::vector<std::string>& cause_names() {
  static const std::vector<std::string> names = {
      "none",     "clamped",  "slewed",    "not finite", "late",    "device lost", "stopped",
      "speed",    "clutched", "passivity", "power",      "derated", "overspeed",   "soft start",
      "dead man", "disarmed", "pose jump", "bad sample", "frozen",  "watchdog"};
  return names;
}

const std::vector<std::string>& state_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (int i = 0; i < H6_DEVICE_STATE_COUNT; ++i)
      all.emplace_back(h6DeviceStateName(static_cast<h6DeviceState>(i)));
    return all;
  }();
  return names;
}

std::size_t cell_bytes(Cell cell) { return cell == Cell::natural32 ? 4 : 8; }

hid_t cell_type(Cell cell) {
  if (cell == Cell::real) return H5T_IEEE_F64LE;
  return cell == Cell::natural32 ? H5T_STD_U32LE : H5T_STD_U64LE;
}

std::vector<hsize_t> shape(const Column& column, hsize_t rows, std::size_t hands) {
  std::vector<hsize_t> dims = {rows};
  if (column.per_hand()) dims.push_back(hands);
  if (column.width > 1) dims.push_back(column.width);
  return dims;
}

std::size_t row_bytes(const Column& column, std::size_t hands) {
  return column.width * cell_bytes(column.cell) * (column.per_hand() ? hands : 1);
}

void pack(const Column& column, std::size_t hands, const h6FrameRecord* from, std::size_t count,
          std::vector<std::byte>& out) {
  const std::size_t bytes = column.width * cell_bytes(column.cell);
  const std::size_t times = column.per_hand() ? hands : 1;
  out.resize(count * times * bytes);
  std::byte* to = out.data();
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t h = 0; h < times; ++h, to += bytes)
      std::memcpy(to,
                  reinterpret_cast<const std::byte*>(from + i) + column.offset + h * column.stride,
                  bytes);
}

void unpack(const Column& column, std::size_t hands, const std::byte* from, std::size_t count,
            h6FrameRecord* out) {
  const std::size_t bytes = column.width * cell_bytes(column.cell);
  const std::size_t times = column.per_hand() ? hands : 1;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t h = 0; h < times; ++h, from += bytes)
      std::memcpy(reinterpret_cast<std::byte*>(out + i) + column.offset + h * column.stride, from,
                  bytes);
}

namespace {
std::mutex& library_mutex() {
  static std::mutex mutex;
  return mutex;
}
}  // namespace

LibraryLock::LibraryLock() : lock_(library_mutex()) { H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr); }

std::string library_reason() {
  std::string reason;
  const auto first = [](unsigned, const H5E_error2_t* entry, void* out) -> herr_t {
    if (entry->desc != nullptr) *static_cast<std::string*>(out) = entry->desc;
    return 1;  // the innermost is all that is wanted
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, first, &reason);
  return reason.empty() ? "the HDF5 library gives no reason" : reason;
}

Handle text_type() {
  Handle type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

Handle fixed_text_type(std::size_t bytes) {
  Handle type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, std::max<std::size_t>(1, bytes));
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  H5Tset_cset(type, H5T_CSET_UTF8);
  return type;
}

}  // namespace recording

namespace {
namespace fs = std::filesystem;

struct Found {
  fs::path file;
  std::uint64_t frames;
  bool whole;
};

bool better(const Found& a, const Found& b) {
  return a.whole != b.whole ? a.whole : a.frames > b.frames;
}

bool maybe_in_use(const fs::path& file) {
  std::error_code failed;
  const auto written = fs::last_write_time(file, failed);
  return !failed && fs::file_time_type::clock::now() - written < std::chrono::seconds(5);
}

// The copies of `file` that can be read, best first; none of them damaged.
std::vector<Found> readable_copies(const fs::path& file, bool with_itself) {
  std::vector<Found> found;
  const fs::path places[] = {file, recording::part_of(file), recording::swap_of(file)};
  for (const fs::path& place : places) {
    std::error_code ignored;
    if ((place == file && !with_itself) || !fs::is_regular_file(place, ignored)) continue;
    const Result<Recording> read = recording::read_one(place, {0, 0});
    if (read) found.push_back({place, read->frame_count, read->whole});
  }
  for (std::size_t i = 1; i < found.size(); ++i)
    if (better(found[i], found[0])) std::swap(found[i], found[0]);
  return found;
}

std::string last_time(const Recording& r) {
  if (r.frames.empty()) return "";
  char text[64];
  std::snprintf(text, sizeof text, " up to %.3f s", r.frames.back().time);
  return text;
}

}  // namespace

Result<Recording> read_recording(const fs::path& name, FrameRange range) {
  const fs::path file = recording::followed(name);
  try {
    const recording::LibraryLock lock;
    Result<Recording> read = recording::read_one(file, range);
    if (!read) {
      const std::vector<Found> copies = readable_copies(file, false);
      if (copies.empty()) return read;
      Result<Recording> copy = recording::read_one(copies[0].file, range);
      if (!copy) return read;
      copy->remark = "read from " + copies[0].file.filename().string() + " because " +
                     file.filename().string() + " does not open: `hapsix info` repairs it";
      return copy;
    }
    if (!read->whole)
      read->remark =
          "the run was killed, or is still going on: frames" + last_time(*read) + " are here";
    return read;
  } catch (const std::bad_alloc&) {
    return Failure{file.string() + " needs more memory than there is: read it in pieces"};
  } catch (const std::exception& problem) {
    return Failure{"cannot read " + file.string() + ": " + problem.what()};
  }
}

Result<std::string> repair_recording(const fs::path& name) {
  const fs::path file = recording::followed(name);
  try {
    const recording::LibraryLock lock;
    const fs::path left[] = {recording::part_of(file), recording::swap_of(file)};
    std::error_code failed;
    const bool is_there = fs::is_regular_file(file, failed);
    const Result<Recording> itself = recording::read_one(file, {0, 0});
    const std::vector<Found> copies = readable_copies(file, false);
    if (!itself && copies.empty()) return itself.failure();
    // Where the file itself does not open no run is going on: it would have published a whole one.
    for (const fs::path& other : left)
      if (itself && maybe_in_use(other)) return std::string();
    const auto shown = [](const fs::path& path) { return path.filename().string(); };
    std::string done;
    if (!itself) {
      done = shown(copies[0].file) + " with " + std::to_string(copies[0].frames) +
             " frames, left by a killed run, is " + shown(file) + " now";
      if (is_there) {
        const fs::path kept = recording::free_name(file, ".damaged");
        fs::rename(file, kept);
        done += "; what was there does not open and is kept as " + shown(kept);
      }
      fs::rename(copies[0].file, file);
    }
    for (const fs::path& other : left)
      if (fs::remove(other, failed))
        done += (done.empty() ? "" : "; ") + shown(other) + ", an older copy, was removed";
    return done;
  } catch (const std::exception& problem) {
    return Failure{"cannot repair " + file.string() + ": " + problem.what()};
  }
}

}  // namespace h6::io
