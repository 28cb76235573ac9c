// SPDX-License-Identifier: Apache-2.0
#include "io/record/layout.h"

#include <algorithm>
#include <cstring>

namespace h6::io::recording {

// Poses, velocities and wrenches are recorded as the doubles they consist of.
static_assert(sizeof(h6Pose) == 7 * sizeof(double) && offsetof(h6Pose, q) == 3 * sizeof(double));
static_assert(sizeof(h6Velocity) == 6 * sizeof(double) && sizeof(h6Wrench) == 6 * sizeof(double));
static_assert(sizeof(h6Cause) == 4 && sizeof(h6Status) == 4 && sizeof(h6DeviceState) == 4);
static_assert(H6_STAGE_COUNT == 7 && H6_CAUSE_COUNT == 20, "names below, format version");
static_assert(offsetof(h6FrameReport, net_stiffness_max) ==
              offsetof(h6FrameReport, net_stiffness_min) + sizeof(double));

const std::vector<Column>& common_columns() {
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
       "bits: 1 arm, 2 disarm, 4 lost, 8 from a fault, 16 from disarmed, 32 slow; fault << 8",
       "safety_asked", true},
      {"overdue", real, 1, input + offsetof(h6SafetyInput, overdue), sizeof(h6SafetyInput), "s",
       "overdue", true},
      {"settings", n32, 1, offsetof(R, settings), 0, "changes so far", "settings", true},
      {"inputs_only", n32, 1, offsetof(R, inputs_only), 0,
       "1: all columns but t, frame, hand_*, buttons, sequence, safety_asked, overdue, settings, "
       "coarse_*, cause and causes are zeros",
       "inputs_only", true},
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
      {"substeps", n32, 1, report + offsetof(h6FrameReport, substeps), 0, "1", "substeps", true},
      {"missed_depth_voxels", real, 1, report + offsetof(h6FrameReport, missed_depth_voxels), 0,
       "voxel", "missed_depth_voxels", true},
      {"status", n32, 1, report + offsetof(h6FrameReport, status), 0, "bits of h6Status", "status"},
      {"hash", n64, 1, report + offsetof(h6FrameReport, state_hash), 0, "1", "hash"},
      {"frame", n64, 1, report + offsetof(h6FrameReport, frame), 0, "1", "frame"},
      {"seal", n64, 1, 0, 0, "hash of this row and the seal before", "seal", true, Part::seal},
  };
  return all;
}

std::vector<Column> columns(const std::vector<RecordedBend>& bends) {
  std::vector<Column> all = common_columns();
  std::size_t offset = 0;
  for (const RecordedBend& bend : bends) {
    std::string labels;
    for (std::size_t j = 1; j <= bend.modes; ++j)
      labels += (j > 1 ? " q" : "q") + std::to_string(j);
    all.push_back({"bend_" + std::to_string(bend.body), Cell::real, bend.modes, offset, 0,
                   "m sqrt(kg)", labels, false, Part::bends, bend.name});
    offset += bend.modes * sizeof(double);
  }
  return all;
}

std::string wrong_bends(const std::vector<RecordedBend>& bends) {
  for (std::size_t i = 0; i < bends.size(); ++i) {
    const std::string body = "body " + std::to_string(bends[i].body);
    if (bends[i].modes < 1 || bends[i].modes > H6_MAX_MODES)
      return body + " bends by " + std::to_string(bends[i].modes) + " modes; 1 to " +
             std::to_string(H6_MAX_MODES) + " can be recorded";
    if (i > 0 && bends[i].body <= bends[i - 1].body)
      return body + " is out of order among the bodies that bend";
  }
  return "";
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
  if (column.width > 1 || column.part == Part::bends) dims.push_back(column.width);
  return dims;
}

std::size_t row_bytes(const Column& column, std::size_t hands) {
  return column.width * cell_bytes(column.cell) * (column.per_hand() ? hands : 1);
}

namespace {

// Where the cells of a column are in memory: of the first row, from row to row.
template <class Byte, class Rows>
std::pair<Byte*, std::size_t> place(const Column& column, const Rows& rows) {
  switch (column.part) {
    case Part::bends:
      return {reinterpret_cast<Byte*>(rows.bends) + column.offset, rows.modes * sizeof(double)};
    case Part::seal:
      return {reinterpret_cast<Byte*>(rows.seals), sizeof(std::uint64_t)};
    default:
      return {reinterpret_cast<Byte*>(rows.records) + column.offset, sizeof(h6FrameRecord)};
  }
}

}  // namespace

void pack(const Column& column, std::size_t hands, const Rows& from, std::vector<std::byte>& out) {
  const std::size_t bytes = column.width * cell_bytes(column.cell);
  const std::size_t times = column.per_hand() ? hands : 1;
  out.resize(from.count * times * bytes);
  std::byte* to = out.data();
  const auto [first, row] = place<const std::byte>(column, from);
  for (std::size_t i = 0; i < from.count; ++i)
    for (std::size_t h = 0; h < times; ++h, to += bytes)
      std::memcpy(to, first + i * row + h * column.stride, bytes);
}

void unpack(const Column& column, std::size_t hands, const std::byte* from,
            const RoomForRows& out) {
  const std::size_t bytes = column.width * cell_bytes(column.cell);
  const std::size_t times = column.per_hand() ? hands : 1;
  const auto [first, row] = place<std::byte>(column, out);
  for (std::size_t i = 0; i < out.count; ++i)
    for (std::size_t h = 0; h < times; ++h, from += bytes)
      std::memcpy(first + i * row + h * column.stride, from, bytes);
}

std::vector<std::byte> pack_chunks(const std::vector<Column>& columns, std::size_t hands,
                                   std::size_t chunk_rows, const Rows& from) {
  std::vector<std::byte> out(columns.size() * sizeof(std::uint32_t)), rows, shuffled;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    pack(columns[i], hands, from, rows);
    rows.resize(chunk_rows * row_bytes(columns[i], hands));  // zeros where rows are still to come
    shuffle(rows, cell_bytes(columns[i].cell), shuffled);
    const auto bytes = static_cast<std::uint32_t>(deflate(shuffled, out));
    std::memcpy(out.data() + i * sizeof bytes, &bytes, sizeof bytes);
  }
  return out;
}

bool find_chunks(const std::vector<std::byte>& payload, std::size_t count,
                 std::vector<Span>& chunks) {
  std::size_t at = count * sizeof(std::uint32_t);
  chunks.clear();
  if (payload.size() < at) return false;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t bytes = 0;
    std::memcpy(&bytes, payload.data() + i * sizeof bytes, sizeof bytes);
    if (bytes > payload.size() - at) return false;
    chunks.push_back({payload.data() + at, bytes});
    at += bytes;
  }
  return at == payload.size();
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
    return 1;  // only the innermost entry is wanted
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

Handle file_access() {
  Handle access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
  H5Pset_file_locking(access, true, true);  // no lock where the file system has none
  return access;
}

}  // namespace h6::io::recording
