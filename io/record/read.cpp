// SPDX-License-Identifier: Apache-2.0
// read.cpp - recordings from HDF5 files; no size or number in a file is trusted.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>

#include "io/file/free_memory.h"
#include "io/record/layout.h"
#include "io/record/seal.h"
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

Result<Source> open_source(const fs::path& file) {
  std::error_code failed;
  if (!fs::is_regular_file(file, failed)) return not_opened(file);
  const std::uint64_t bytes = fs::file_size(file, failed);
  Handle h5 = H5Fopen(file.c_str(), H5F_ACC_RDONLY, file_access());
  if (failed || !h5.ok()) return not_opened(file);
  return Source{file, bytes, std::move(h5), "recording"};
}

Result<Handle> open_group(const Source& source, const char* name) {
  if (!has(source.h5, name, H5I_GROUP))
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

// Whether every number of a packed column is one of its enumerators or sets of bits.
bool means_something(std::string_view name, const std::vector<std::byte>& packed) {
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

Outcome read_column(const Source& source, const Column& column, const Stored& stored, hsize_t first,
                    Recording& out) {
  std::vector<std::byte> packed;
  const std::size_t modes = modes_of(out.head.bends);
  // Pieces end where chunks end, so that each chunk is inflated once.
  const hsize_t piece =
      std::max<hsize_t>(1, rows_at_once / std::max<hsize_t>(1, stored.chunk_rows)) *
      std::max<hsize_t>(1, stored.chunk_rows);
  const hsize_t end = first + out.frames.size();
  for (hsize_t row = first; row < end;) {
    const hsize_t count = std::min(piece - row % piece, end - row);
    if (Outcome read = read_rows(source, stored, row, count, packed); !read) return read;
    if (!means_something(column.name, packed))
      return source.wrong("/frames/" + column.name + " has a number that means nothing");
    const hsize_t at = row - first;
    unpack(column, out.head.hands, packed.data(),
           {out.frames.data() + at, out.bends.data() + at * modes, out.seals.data() + at, count,
            modes});
    row += count;
  }
  return Done{};
}

// Linux grants more memory than the machine has and kills the program later, without a message.
Outcome check_memory(const fs::path& file, std::uint64_t frames, std::size_t modes) {
  const std::uint64_t half = free_memory().value_or(UINT64_MAX) / 2;
  if (frames <= half / (sizeof(h6FrameRecord) + modes * sizeof(double))) return Done{};
  return Failure{file.string() + ": " + std::to_string(frames) +
                 " frames are more than fit into half of the free memory: read it in pieces"};
}

// In the order of columns(); without a dataset where an older file has none.
Result<std::vector<Stored>> open_columns(const Source& source, const std::vector<Column>& columns,
                                         std::size_t hands) {
  const Result<Handle> group = open_group(source, "/frames");
  if (!group) return group.failure();
  std::vector<Stored> open;
  for (const Column& column : columns) {
    if (column.later && H5Lexists(*group, column.name.c_str(), H5P_DEFAULT) == 0) {
      open.emplace_back();
      continue;
    }
    Result<Stored> stored =
        open_stored(source, *group, "/frames", column.name.c_str(), cell_type(column.cell));
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
  const std::vector<Column> all = columns(out.head.bends);
  const std::size_t modes = modes_of(out.head.bends);
  const Result<std::vector<Stored>> open = open_columns(source, all, out.head.hands);
  if (!open) return open.failure();
  const hsize_t rows = (*open)[0].dims[0], first = std::min<hsize_t>(range.first, rows);
  const hsize_t wanted = std::min<hsize_t>(range.count, rows - first);
  if (Outcome room = check_memory(source.file, wanted, modes); !room) return room;
  out.frame_count = rows;
  out.frames.resize(wanted, h6FrameRecord{});
  out.bends.resize(wanted * modes);
  for (std::size_t i = 0; i < open->size(); ++i) {
    if (!(*open)[i].dataset.ok()) continue;
    out.columns.push_back(all[i].name);
    if (all[i].part == Part::seal) out.seals.resize(wanted);
    if (Outcome read = read_column(source, all[i], (*open)[i], first, out); !read) return read;
  }
  return Done{};
}

// The seals of a part. Empty where the file has none, which is older then.
Result<std::vector<std::uint64_t>> read_seals(const Source& source, const char* folder,
                                              hsize_t count) {
  const Result<Handle> group = open_group(source, folder);
  if (!group) return group.failure();
  std::vector<std::uint64_t> seals;
  if (!has(*group, "seal", H5I_DATASET)) return seals;
  const Result<Stored> stored = open_stored(source, *group, folder, "seal", H5T_STD_U64LE);
  if (!stored) return stored.failure();
  if (stored->dims != std::vector<hsize_t>{count})
    return source.wrong(stored->name + " has another shape");
  std::vector<std::byte> bytes;
  if (Outcome read = read_rows(source, *stored, 0, count, bytes); !read) return read.failure();
  seals.resize(count);
  if (count > 0) std::memcpy(seals.data(), bytes.data(), bytes.size());
  return seals;
}

// Compares head, events and summary with their seals.
Outcome check_seals(const Source& source, const std::string& head, Recording& out) {
  const auto of_head = read_seals(source, "/config", 1),
             of_events = read_seals(source, "/events", out.events.size());
  if (!of_head || !of_events) return (of_head ? of_events : of_head).failure();
  out.sealed = !of_head->empty() && of_events->size() == out.events.size();
  if (!out.sealed) return Done{};
  std::uint64_t seal = seal_of_text(0, head);
  if (seal != of_head->front()) out.unsealed = "its head";
  for (std::size_t i = 0; i < out.events.size(); ++i) {
    seal = seal_of_event(seal, out.events[i]);
    if (out.unsealed.empty() && seal != (*of_events)[i])
      out.unsealed = "event " + std::to_string(i) + " (" + out.events[i].what + ")";
  }
  if (!out.whole) return Done{};
  const auto of_summary = read_seals(source, "/summary", 1);
  if (!of_summary) return of_summary.failure();
  out.sealed = !of_summary->empty();
  if (out.sealed && out.unsealed.empty() &&
      seal_of_summary(seal, out.frame_count, out.summary_json) != of_summary->front())
    out.unsealed = "its summary";
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

// Throws what is no list of bodies that bend.
std::vector<RecordedBend> parse_bends(const json& all) {
  std::vector<RecordedBend> bends;
  for (const json& bend : all) {
    const double body = bend.at("body").get<double>(), modes = bend.at("modes").get<double>();
    const bool whole = body >= 0 && body <= INT32_MAX && body == std::floor(body) && modes >= 1 &&
                       modes <= H6_MAX_MODES && modes == std::floor(modes);
    bends.push_back({whole ? static_cast<std::uint32_t>(body) : 0,
                     bend.at("name").get<std::string>(),
                     whole ? static_cast<std::size_t>(modes) : 0});
  }
  return bends;
}

}  // namespace

Result<RecordingHead> parse_head(const std::string& text) {
  RecordingHead head;
  try {
    const json all = json::parse(text);
    if (all.at("version").get<double>() != format_version)
      return Failure{"its version is not " + std::to_string(format_version) +
                     "; use the program that made it"};
    head.scene_json = all.at("json").get<std::string>();
    head.asset_hashes = all.at("asset_hashes").get<std::vector<std::string>>();
    head.simd_target = all.at("simd_target").get<std::string>();
    head.program = all.at("program").get<std::string>();
    head.run_json = all.value("run", std::string());  // older files lack it
    head.rate = all.at("rate").get<double>();
    const double hands = all.at("hands").get<double>();
    if (!(head.rate > 0 && head.rate <= 1e6)) return Failure{"the rate is not in 0 to 1000000 Hz"};
    if (!(hands >= 1 && hands <= H6_MAX_HANDS && hands == std::floor(hands)))
      return Failure{"the number of hands is not 1 to " + std::to_string(H6_MAX_HANDS)};
    head.hands = static_cast<std::size_t>(hands);
    if (all.contains("bends")) head.bends = parse_bends(all["bends"]);
    if (const std::string wrong = wrong_bends(head.bends); !wrong.empty()) return Failure{wrong};
  } catch (const json::exception& problem) {
    return Failure{std::string("its head: ") + problem.what()};
  }
  return head;
}

Result<Recording> read_hdf5(const fs::path& file, FrameRange range) {
  Result<Source> source = open_source(file);
  if (!source) return source.failure();
  Recording out;
  const Result<std::string> text = read_whole_text(*source, "/config");
  if (!text) return text.failure();
  Result<RecordingHead> head = parse_head(*text);
  if (!head) return source->wrong(head.error());
  out.head = std::move(*head);
  if (Outcome read = read_frames(*source, range, out); !read) return read.failure();
  if (Outcome read = read_events(*source, out.events); !read) return read.failure();
  if (Outcome read = read_summary(*source, out); !read) return read.failure();
  if (Outcome read = check_seals(*source, *text, out); !read) return read.failure();
  return out;
}

}  // namespace h6::io::recording
