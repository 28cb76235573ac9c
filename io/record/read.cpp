// SPDX-License-Identifier: Apache-2.0
// read.cpp - recordings from disk; nothing that a file says about itself is believed.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>
#include <thread>

#include "io/record/layout.h"
#include "io/record/stored.h"

namespace h6::io::recording {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr hsize_t rows_at_once = 4096;

Failure not_opened(const fs::path& file) {
  const std::string cannot = "cannot read " + file.string() + ": ";
  std::error_code failed;
  const fs::file_status status = fs::status(file, failed);
  if (!fs::exists(status)) return {cannot + "there is no such file"};
  if (!fs::is_regular_file(status)) return {cannot + "it is not an ordinary file"};
  if (::access(file.c_str(), R_OK) != 0) return {cannot + "you may not read it"};
  if (H5Fis_hdf5(file.c_str()) == 0)
    return {cannot + "it is not an HDF5 file; recordings are made by `hapsix run --record`"};
  return {cannot + library_reason() + "; it is damaged or cut off, use another copy"};
}

Handle try_open(const fs::path& file) {
  std::error_code failed;
  if (!fs::is_regular_file(file, failed)) return {};
  const Handle access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
  H5Pset_file_locking(access, true, true);  // where the file system cannot lock, go without
  return H5Fopen(file.c_str(), H5F_ACC_RDONLY, access);
}

// While a run goes on, the file can become its spare copy between open and lock: try again.
Result<Source> open_source(const fs::path& file) {
  for (int attempt = 0; attempt < 3; ++attempt) {
    std::error_code failed;
    Handle h5 = try_open(file);
    const std::uint64_t bytes = fs::file_size(file, failed);
    if (h5.ok() && !failed) return Source{file, bytes, std::move(h5)};
    fs::path part = file;
    part += ".part";
    if (!fs::exists(part, failed)) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return not_opened(file);
}

Result<Handle> open_group(const Source& source, const char* name) {
  if (!has(source.h5, name, H5O_TYPE_GROUP))
    return source.wrong(std::string("the group ") + name + " is missing");
  Handle group = H5Gopen2(source.h5, name, H5P_DEFAULT);
  if (!group.ok()) return source.wrong(library_reason());
  return group;
}

// Up to the first NUL, which pads texts of one length.
std::string text_at(const std::byte* at, std::size_t bytes) {
  const char* text = reinterpret_cast<const char*>(at);
  return {text, strnlen(text, bytes)};
}

Result<std::string> read_whole_text(const Source& source, const char* folder) {
  const Result<Handle> group = open_group(source, folder);
  if (!group) return group.failure();
  const Result<Stored> stored = open_stored_texts(source, *group, folder, "whole");
  if (!stored) return stored.failure();
  if (stored->dims != std::vector<hsize_t>{1})
    return source.wrong(stored->name + " is not one text");
  std::vector<std::byte> bytes;
  if (Outcome read = read_rows(source, *stored, 0, 1, bytes); !read) return read.failure();
  return text_at(bytes.data(), bytes.size());
}

Outcome read_head(const Source& source, RecordingHead& head) {
  const Result<std::string> text = read_whole_text(source, "/config");
  if (!text) return text.failure();
  try {
    const json all = json::parse(*text);
    if (all.at("version").get<double>() != format_version)
      return source.wrong("its version is not " + std::to_string(format_version) +
                          "; use the program that made it");
    head.scene_json = all.at("json").get<std::string>();
    head.asset_hashes = all.at("asset_hashes").get<std::vector<std::string>>();
    head.simd_target = all.at("simd_target").get<std::string>();
    head.program = all.at("program").get<std::string>();
    head.run_json = all.value("run", std::string());  // older files do without
    head.rate = all.at("rate").get<double>();
    const double hands = all.at("hands").get<double>();
    if (!(head.rate > 0 && head.rate <= 1e6))
      return source.wrong("the rate is not in 0 to 1000000 Hz");
    if (!(hands >= 1 && hands <= H6_MAX_HANDS && hands == std::floor(hands)))
      return source.wrong("the number of hands is not 1 to " + std::to_string(H6_MAX_HANDS));
    head.hands = static_cast<std::size_t>(hands);
  } catch (const json::exception& problem) {
    return source.wrong(std::string("/config/whole: ") + problem.what());
  }
  return Done{};
}

// Names are checked before they become enumerations, bits before anybody looks for their names.
bool means_something(const char* column, const std::vector<std::byte>& packed) {
  const std::string_view name = column;
  const std::uint32_t most = name == "cause"          ? H6_CAUSE_COUNT - 1
                             : name == "causes"       ? (1u << H6_CAUSE_COUNT) - 1
                             : name == "state"        ? H6_DEVICE_STATE_COUNT - 1
                             : name == "safety_asked" ? (H6_CAUSE_COUNT << 8) - 1
                                                      : UINT32_MAX;
  for (std::size_t at = 0; most < UINT32_MAX && at + 4 <= packed.size(); at += 4) {
    std::uint32_t number = 0;
    std::memcpy(&number, packed.data() + at, 4);
    if (number > most) return false;
  }
  return true;
}

Outcome read_column(const Source& source, const Column& column, const Stored& stored,
                    std::size_t hands, hsize_t first, std::vector<h6FrameRecord>& frames) {
  std::vector<std::byte> packed;
  // Pieces end where chunks end, so that each chunk is inflated once.
  const hsize_t piece =
      std::max<hsize_t>(1, rows_at_once / std::max<hsize_t>(1, stored.chunk_rows)) *
      std::max<hsize_t>(1, stored.chunk_rows);
  const hsize_t end = first + frames.size();
  for (hsize_t row = first; row < end;) {
    const hsize_t count = std::min(piece - row % piece, end - row);
    if (Outcome read = read_rows(source, stored, row, count, packed); !read) return read;
    if (!means_something(column.name, packed))
      return source.wrong("/frames/" + std::string(column.name) +
                          " has a number that means nothing");
    unpack(column, hands, packed.data(), count, frames.data() + (row - first));
    row += count;
  }
  return Done{};
}

// Memory that is promised and not there ends the program much later, without a sentence.
hsize_t most_frames_in_memory() {
  const long pages = ::sysconf(_SC_PHYS_PAGES), bytes = ::sysconf(_SC_PAGESIZE);
  if (pages <= 0 || bytes <= 0) return UINT32_MAX;
  return static_cast<hsize_t>(pages) / 2 * static_cast<hsize_t>(bytes) / sizeof(h6FrameRecord);
}

// In the order of columns(); without a dataset where an older file has none.
Result<std::vector<Stored>> open_columns(const Source& source, std::size_t hands) {
  const Result<Handle> group = open_group(source, "/frames");
  if (!group) return group.failure();
  std::vector<Stored> open;
  for (const Column& column : columns()) {
    if (column.later && H5Lexists(*group, column.name, H5P_DEFAULT) == 0) {
      open.emplace_back();
      continue;
    }
    Result<Stored> stored =
        open_stored(source, *group, "/frames", column.name, cell_type(column.cell));
    if (!stored) return stored.failure();
    const hsize_t rows = stored->dims[0];
    if (stored->dims != shape(column, rows, hands))
      return source.wrong(stored->name + " has another shape");
    if (!open.empty() && rows != open[0].dims[0])
      return source.wrong(stored->name + " has " + std::to_string(rows) + " rows where " +
                          open[0].name + " has " + std::to_string(open[0].dims[0]));
    open.push_back(std::move(*stored));
  }
  return open;
}

Outcome read_frames(const Source& source, FrameRange range, Recording& out) {
  const Result<std::vector<Stored>> open = open_columns(source, out.head.hands);
  if (!open) return open.failure();
  const hsize_t rows = (*open)[0].dims[0], first = std::min<hsize_t>(range.first, rows);
  const hsize_t wanted = std::min<hsize_t>(range.count, rows - first);
  if (wanted > most_frames_in_memory())
    return Failure{source.file.string() + " has " + std::to_string(rows) +
                   " frames, more than fit into half of this machine's memory: read it in pieces"};
  out.frame_count = rows;
  out.frames.resize(wanted, h6FrameRecord{});
  for (std::size_t i = 0; i < open->size(); ++i) {
    if (!(*open)[i].dataset.ok()) continue;
    out.columns.push_back(columns()[i].name);
    if (Outcome read =
            read_column(source, columns()[i], (*open)[i], out.head.hands, first, out.frames);
        !read)
      return read;
  }
  return Done{};
}

Outcome read_events(const Source& source, std::vector<RecordingEvent>& events) {
  const Result<Handle> group = open_group(source, "/events");
  if (!group) return group.failure();
  const Result<Stored> t = open_stored(source, *group, "/events", "t", H5T_IEEE_F64LE);
  const Result<Stored> what = open_stored_texts(source, *group, "/events", "what");
  const Result<Stored> detail = open_stored_texts(source, *group, "/events", "detail");
  for (const Result<Stored>* column : {&t, &what, &detail}) {
    if (!*column) return column->failure();
    if ((*column)->dims.size() != 1 || (*column)->dims[0] != t->dims[0])
      return source.wrong((*column)->name + " has another shape");
  }
  std::vector<std::byte> times, whats, details;
  for (hsize_t row = 0; row < t->dims[0]; row += rows_at_once) {
    const hsize_t count = std::min(rows_at_once, t->dims[0] - row);
    if (Outcome read = read_rows(source, *t, row, count, times); !read) return read;
    if (Outcome read = read_rows(source, *what, row, count, whats); !read) return read;
    if (Outcome read = read_rows(source, *detail, row, count, details); !read) return read;
    for (hsize_t i = 0; i < count; ++i) {
      RecordingEvent event{0, text_at(&whats[i * what->row_bytes], what->row_bytes),
                           text_at(&details[i * detail->row_bytes], detail->row_bytes)};
      std::memcpy(&event.time, &times[i * 8], 8);
      events.push_back(std::move(event));
    }
  }
  return Done{};
}

Outcome read_summary(const Source& source, Recording& out) {
  out.whole = H5Lexists(source.h5, "summary", H5P_DEFAULT) > 0;
  if (!out.whole) return Done{};
  Result<std::string> text = read_whole_text(source, "/summary");
  if (!text) return text.failure();
  out.summary_json = std::move(*text);
  return Done{};
}

}  // namespace

Result<Recording> read_one(const fs::path& file, FrameRange range) {
  Result<Source> source = open_source(file);
  if (!source) return source.failure();
  Recording out;
  if (Outcome read = read_head(*source, out.head); !read) return read.failure();
  if (Outcome read = read_frames(*source, range, out); !read) return read.failure();
  if (Outcome read = read_events(*source, out.events); !read) return read.failure();
  if (Outcome read = read_summary(*source, out); !read) return read.failure();
  return out;
}

}  // namespace h6::io::recording
