// SPDX-License-Identifier: Apache-2.0
#include "io/record/to_hdf5.h"

#include <sys/resource.h>
#include <unistd.h>

#include <cstring>
#include <system_error>

#include "io/file/write_aside.h"
#include "io/record/layout.h"
#include "io/record/put.h"
#include "io/record/seal.h"

namespace h6::io::recording {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t event_chunk = 64;  // rows
constexpr std::size_t events_at_once = 1024;

bool put_number(hid_t at, const char* name, hid_t disk, hid_t memory, const void* number) {
  const Handle space = H5Screate(H5S_SCALAR);
  const Handle made = H5Acreate2(at, name, disk, space, H5P_DEFAULT, H5P_DEFAULT);
  return made.ok() && H5Awrite(made, memory, number) >= 0;
}

// One text of fixed length as the dataset `whole`: what read_recording reads.
bool put_whole(hid_t group, const std::string& text) {
  const hsize_t one = 1;
  const Handle type = fixed_text_type(text.size()), space = H5Screate_simple(1, &one, nullptr);
  const Handle made =
      H5Dcreate2(group, "whole", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  return made.ok() && H5Dwrite(made, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.c_str()) >= 0;
}

// One seal, as the dataset `seal`.
bool put_seal(hid_t group, std::uint64_t seal) {
  const hsize_t one = 1;
  const Handle space = H5Screate_simple(1, &one, nullptr);
  const Handle made =
      H5Dcreate2(group, "seal", H5T_STD_U64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  return made.ok() && H5Dwrite(made, H5T_NATIVE_UINT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, &seal) >= 0;
}

bool put_head(hid_t file, const RecordingHead& head, const std::string& whole) {
  const Handle config = H5Gcreate2(file, "config", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const auto hands = static_cast<std::uint32_t>(head.hands);
  return config.ok() && put_whole(config, whole) && put_seal(config, seal_of_text(0, whole)) &&
         put_number(config, "version", H5T_STD_U32LE, H5T_NATIVE_UINT32, &format_version) &&
         put_text(config, "json", head.scene_json) &&
         put_texts(config, "asset_hashes", head.asset_hashes) &&
         put_text(config, "simd_target", head.simd_target) &&
         put_text(config, "program", head.program) && put_text(config, "run", head.run_json) &&
         put_number(config, "rate", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &head.rate) &&
         put_number(config, "hands", H5T_STD_U32LE, H5T_NATIVE_UINT32, &hands) &&
         put_texts(config, "stage_names", stage_names()) &&
         put_texts(config, "cause_names", cause_names()) &&
         put_texts(config, "state_names", state_names()) &&
         put_text(config, "units",
                  "SI: m, s, N, N m, rad; times of stages in us; quaternions w x y z; world frame; "
                  "poses of the mesh frame, torque about the body's centre of mass");
}

// ---- the parts of a recording

struct LogSource {
  const File& log;
  LogIndex index;
  RecordingHead head;
};

// The chunks are in the log as HDF5 stores them, so nothing is compressed again.
bool put_frames(hid_t file, const LogSource& from) {
  const Handle group = H5Gcreate2(file, "frames", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  std::vector<Handle> datasets;
  for (const Column& column : columns(from.head.bends)) {
    datasets.push_back(make_dataset(group, column.name.c_str(), cell_type(column.cell),
                                    from.index.row_count,
                                    shape(column, from.index.chunk_rows, from.head.hands)));
    const hid_t made = datasets.back();
    if (made < 0 || !put_text(made, "units", column.units) ||
        !put_text(made, "columns", column.labels) ||
        (column.part == Part::bends && !put_text(made, "body", column.body)))
      return false;
  }
  std::vector<std::byte> payload;
  for (const Payload& rows : from.index.rows) {
    std::vector<Span> chunks;
    if (!read_payload(from.log, rows, payload) || !find_chunks(payload, datasets.size(), chunks))
      return false;
    for (std::size_t i = 0; i < datasets.size(); ++i) {
      const hsize_t at[3] = {rows.record.first, 0, 0};
      if (H5Dwrite_chunk(datasets[i], H5P_DEFAULT, 0, at, chunks[i].bytes, chunks[i].from) < 0)
        return false;
    }
  }
  return true;
}

RecordingEvent event_of(const EventRow& row) {
  return {row.t, std::string(row.what, strnlen(row.what, sizeof row.what)),
          std::string(row.detail, strnlen(row.detail, sizeof row.detail))};
}

// `seal`: of what comes before the events, and then of the last one.
bool put_events(hid_t file, const LogSource& from, std::uint64_t& seal) {
  const Handle group = H5Gcreate2(file, "events", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const Handle what_type = fixed_text_type(event_what_bytes);
  const Handle detail_type = fixed_text_type(event_detail_bytes);
  const hsize_t count = from.index.events.size();
  const Handle t = make_dataset(group, "t", H5T_IEEE_F64LE, count, {event_chunk});
  const Handle what = make_dataset(group, "what", what_type, count, {event_chunk});
  const Handle detail = make_dataset(group, "detail", detail_type, count, {event_chunk});
  const Handle sealed = make_dataset(group, "seal", H5T_STD_U64LE, count, {event_chunk});
  if (!t.ok() || !what.ok() || !detail.ok() || !sealed.ok() || !put_text(t, "units", "s"))
    return false;
  std::vector<std::byte> payload;
  for (hsize_t first = 0; first < count; first += events_at_once) {
    const hsize_t here = std::min<hsize_t>(events_at_once, count - first);
    std::vector<double> times;
    std::vector<std::uint64_t> seals;
    std::string whats, details;
    for (hsize_t i = first; i < first + here; ++i) {
      EventRow row;
      if (!read_payload(from.log, from.index.events[i], payload)) return false;
      std::memcpy(&row, payload.data(), sizeof row);
      times.push_back(row.t);
      whats.append(row.what, sizeof row.what);
      details.append(row.detail, sizeof row.detail);
      seals.push_back(seal = seal_of_event(seal, event_of(row)));
    }
    if (!write_rows(t, H5T_NATIVE_DOUBLE, first, here, times.data()) ||
        !write_rows(what, what_type, first, here, whats.data()) ||
        !write_rows(detail, detail_type, first, here, details.data()) ||
        !write_rows(sealed, H5T_NATIVE_UINT64, first, here, seals.data()))
      return false;
  }
  return true;
}

bool put_summary_text(hid_t file, const std::string& text, std::uint64_t seal) {
  const Handle group = H5Gcreate2(file, "summary", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  return group.ok() && put_whole(group, text) && put_text(group, "json", text) &&
         put_seal(group, seal);
}

bool put_summary(hid_t file, const LogSource& from, std::uint64_t seal) {
  if (!from.index.summary) return true;
  std::vector<std::byte> payload;
  if (!read_payload(from.log, *from.index.summary, payload)) return false;
  const std::string text(reinterpret_cast<const char*>(payload.data()), payload.size());
  return put_summary_text(file, text, seal_of_summary(seal, from.index.row_count, text));
}

// HDF5 cannot close a file whose last pages do not fit on the disk, so check for room first.
Outcome check_room(const fs::path& out, const LogIndex& index, std::size_t columns) {
  const std::uint64_t chunks = (index.rows.size() + 1) * columns;
  const std::uint64_t needed = index.end + chunks * 128 + (256 << 10);
  rlimit limit{};
  std::error_code failed;
  const fs::space_info space = fs::space(out.parent_path(), failed);
  if ((getrlimit(RLIMIT_FSIZE, &limit) == 0 && needed > limit.rlim_cur) ||
      (!failed && space.available < needed))
    return Failure{"no room for " + std::to_string((needed >> 20) + 1) + " MiB more on the disk"};
  return Done{};
}

fs::path free_name(const fs::path& file) {
  fs::path name = file;
  std::error_code ignored;
  for (int i = 1; name == file || fs::exists(fs::symlink_status(name, ignored)); ++i)
    name = file.string() + ".before" + (i > 1 ? "-" + std::to_string(i) : "");
  return name;
}

}  // namespace

Outcome write_hdf5(const File& log, const fs::path& out) {
  std::optional<LogIndex> index = index_log(log);
  if (!index) return Failure{"its log is damaged at the start"};
  Result<RecordingHead> head = parse_head(index->head);
  if (!head) return head.failure();
  const LogSource from{log, std::move(*index), std::move(*head)};
  if (Outcome room = check_room(out, from.index, columns(from.head.bends).size()); !room)
    return room;
  const LibraryLock lock;
  // The library's oldest file format, which is its default: MATLAB reads it.
  const Handle h5 = H5Fcreate(out.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, file_access());
  std::uint64_t seal = seal_of_text(0, from.index.head);
  if (!h5.ok() || !put_head(h5, from.head, from.index.head) || !put_frames(h5, from) ||
      !put_events(h5, from, seal) || !put_summary(h5, from, seal) ||
      H5Fflush(h5, H5F_SCOPE_GLOBAL) < 0)
    return Failure{library_reason()};
  return Done{};
}

bool put_empty(hid_t file, const RecordingHead& head, const std::string& summary) {
  const File no_log;
  const LogSource from{no_log, LogIndex{"", 1, {}, {}, {}, 0, 0}, head};
  std::uint64_t seal = 0;
  return put_head(file, head, "") && put_frames(file, from) && put_events(file, from, seal) &&
         put_summary_text(file, summary, seal);
}

Outcome publish(const File& log, const fs::path& file, bool keep_older, fs::path* kept) {
  const Outcome written = write_aside(file, [&](const fs::path& out) -> Outcome {
    if (Outcome made = write_hdf5(log, out); !made) return made;
    std::error_code failed;
    if (!keep_older || !fs::exists(file, failed)) return Done{};
    const fs::path name = free_name(file);
    fs::rename(file, name);
    if (kept) *kept = name;
    return Done{};
  });
  const fs::path log_name = part_of(file);
  if (!written)
    return Failure{"the run is in " + log_name.string() + " and not yet in " +
                   file.filename().string() + " (" + written.error() +
                   "): mend that, then `hapsix info " + file.string() + "` finishes it"};
  if (log.named(log_name)) ::unlink(log_name.c_str());
  return Done{};
}

}  // namespace h6::io::recording
