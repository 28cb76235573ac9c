// SPDX-License-Identifier: Apache-2.0
// recorder.cpp - appends frames and events to the log, which becomes HDF5 at the end.
//
//   frames() -> rows of one chunk --- full, or 0.3 s old ---> log --- finish() ---> HDF5
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <system_error>

#include "io/record/layout.h"
#include "io/record/log.h"
#include "io/record/seal.h"
#include "io/record/to_hdf5.h"

namespace h6::io {
namespace fs = std::filesystem;
using namespace recording;
using Clock = std::chrono::steady_clock;

namespace {

constexpr auto longest_wait = std::chrono::milliseconds(300);  // of a row before it is written
constexpr double longest_span = 0.3;                           // [s] of recorded time

bool is_json_object(const std::string& text) {
  const auto parsed = nlohmann::json::parse(text, nullptr, false);
  return parsed.is_object();
}

std::vector<std::byte> bytes_of(const void* from, std::size_t count) {
  const auto* bytes = static_cast<const std::byte*>(from);
  return {bytes, bytes + count};
}

nlohmann::json bends_json(const std::vector<RecordedBend>& bends) {
  nlohmann::json all = nlohmann::json::array();
  for (const RecordedBend& bend : bends)
    all.push_back({{"body", bend.body}, {"name", bend.name}, {"modes", bend.modes}});
  return all;
}

std::string whole_head(const RecordingHead& head) {
  nlohmann::json all = {{"version", format_version},
                        {"json", head.scene_json},
                        {"asset_hashes", head.asset_hashes},
                        {"simd_target", head.simd_target},
                        {"program", head.program},
                        {"rate", head.rate},
                        {"hands", head.hands},
                        {"run", head.run_json}};
  if (!head.bends.empty()) all["bends"] = bends_json(head.bends);
  return all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Copies what fits; a cut does not leave half a UTF-8 character.
void fill(char* to, std::size_t room, const std::string& text) {
  std::size_t end = std::min(room, text.size());
  if (end < text.size())
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  std::memcpy(to, text.data(), end);
}

Failure refuse(const fs::path& file, const std::string& why) {
  return {"cannot record to " + file.string() + ": " + why};
}

// Only recordings and empty files make room for a new one.
Outcome may_replace(const fs::path& file) {
  std::error_code failed;
  const fs::file_status status = fs::status(file, failed);
  if (fs::is_directory(status)) return refuse(file, "it is a folder; name a file in it");
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (!fs::exists(status)) {
    if (fs::is_directory(folder, failed)) return Done{};
    return refuse(file, "the folder " + folder.string() + " does not exist; create it");
  }
  if (!fs::is_regular_file(status)) return refuse(file, "it is not an ordinary file");
  const LibraryLock lock;
  if (fs::file_size(file, failed) == 0 || H5Fis_hdf5(file.c_str()) > 0) return Done{};
  return refuse(file, "a file that is not a recording is there; choose another name");
}

Outcome check_head(const fs::path& file, const RecordingHead& head) {
  if (head.hands < 1 || head.hands > H6_MAX_HANDS)
    return refuse(file, std::to_string(head.hands) + " hands; 1 to " +
                            std::to_string(H6_MAX_HANDS) + " can be recorded");
  if (!(head.rate > 0 && head.rate <= 1e6))
    return refuse(file, "the rate must be above 0 and at most 1000000 Hz");
  if (const std::string wrong = wrong_bends(head.bends); !wrong.empty()) return refuse(file, wrong);
  if (!head.scene_json.empty() && !is_json_object(head.scene_json))
    return refuse(file, "the scene is not one JSON object");
  return Done{};
}

}  // namespace

struct Recorder::Body {
  Body(fs::path place, const RecordingHead& head)
      : file(std::move(place)),
        log_name(part_of(file)),
        columns(recording::columns(head.bends)),
        hands(head.hands),
        modes(modes_of(head.bends)),
        chunk_rows(static_cast<std::size_t>(std::clamp(head.rate / 4, 16.0, 4096.0))),
        seal(head) {}

  const fs::path file, log_name;
  const std::vector<Column> columns;
  const std::size_t hands, modes, chunk_rows;  // a chunk takes a quarter of a second, within bounds
  File log;
  std::uint64_t log_end = 0;  // [bytes]

  std::vector<h6FrameRecord> rows;  // of the chunk that is not full yet
  std::vector<double> bends;        // (rows x modes)
  std::vector<std::uint64_t> seals;
  RowSeal seal;
  std::uint64_t first = 0;          // number of rows[0]
  std::size_t logged = 0;           // number of `rows` that are in the log
  Clock::time_point waiting_since;  // of the oldest row that is not
  double logged_until = 0;          // [s] of recorded time
  bool open = false, empty = true;
  std::string broken;  // the sentence of the failure that ended recording

  Outcome create(const RecordingHead& head);
  Outcome usable() const;
  Outcome add(const h6FrameRecord* records, const double* q, std::size_t count);
  void keep(const h6FrameRecord* records, const double* q, std::size_t count);
  Outcome write_rows();
  Outcome write_event(const RecordingEvent& event);
  Outcome write(LogRecord record, const std::vector<std::byte>& payload);
  Outcome stop(const std::string& why);
  Outcome finish(const std::string& summary_json);
  void leave();
  // Exceptions of packages and the standard library end recording with a sentence.
  template <class Work>
  Outcome guarded(Work&& work) {
    try {
      return work();
    } catch (const std::exception& problem) {
      return stop(problem.what());
    }
  }
};

Outcome Recorder::Body::create(const RecordingHead& head) {
  log = create_log(log_name);
  if (!log.ok() && errno == EEXIST) {
    const Result<std::string> settled = repair_recording(file);
    if (!settled) return settled.failure();
    log = create_log(log_name);
  }
  if (!log.ok() && errno == EEXIST)
    return refuse(file, "another run is recording to it; give every run its own file");
  if (!log.ok()) return refuse(file, std::strerror(errno));
  const std::string text = whole_head(head);
  LogRecord record{};
  record.kind = LogKind::head;
  record.count = static_cast<std::uint32_t>(chunk_rows);
  if (const int error = append(log, log_end, record, bytes_of(text.data(), text.size()))) {
    ::unlink(log_name.c_str());
    return refuse(file, std::strerror(error));
  }
  rows.reserve(chunk_rows);
  bends.reserve(chunk_rows * modes);
  seals.reserve(chunk_rows);
  open = true;
  return Done{};
}

Outcome Recorder::Body::usable() const {
  if (!broken.empty()) return Failure{broken};
  if (!open) return refuse(file, "this recording is finished");
  return Done{};
}

void Recorder::Body::keep(const h6FrameRecord* records, const double* q, std::size_t count) {
  rows.insert(rows.end(), records, records + count);
  const std::size_t end = bends.size();
  bends.resize(end + count * modes, std::numeric_limits<double>::quiet_NaN());
  if (q) std::copy_n(q, count * modes, bends.data() + end);
  for (std::size_t i = 0; i < count; ++i)
    seals.push_back(seal.next(records[i], bends.data() + end + i * modes));
}

Outcome Recorder::Body::add(const h6FrameRecord* records, const double* q, std::size_t count) {
  if (Outcome can = usable(); !can) return can;
  while (count > 0) {
    const std::size_t part = std::min(count, chunk_rows - rows.size());
    if (rows.size() == logged) waiting_since = Clock::now();
    keep(records, q, part);
    records += part, count -= part;
    if (q) q += part * modes;
    if (rows.size() < chunk_rows) break;
    if (Outcome written = write_rows(); !written) return written;
    first += chunk_rows;
    rows.clear();
    bends.clear();
    seals.clear();
    logged = 0;
  }
  if (rows.size() == logged) return Done{};
  const bool waited = Clock::now() - waiting_since >= longest_wait;
  return waited || rows.back().time - logged_until >= longest_span ? write_rows() : Done{};
}

Outcome Recorder::Body::write_rows() {
  if (rows.size() == logged) return Done{};
  LogRecord record{};
  record.kind = LogKind::rows;
  record.first = first;
  record.count = static_cast<std::uint32_t>(rows.size());
  logged = rows.size();
  logged_until = rows.back().time;
  const Rows all{rows.data(), bends.data(), seals.data(), rows.size(), modes};
  return write(record, pack_chunks(columns, hands, chunk_rows, all));
}

Outcome Recorder::Body::write_event(const RecordingEvent& event) {
  if (Outcome can = usable(); !can) return can;
  EventRow row{};
  row.t = event.time;
  fill(row.what, sizeof row.what, event.what);
  fill(row.detail, sizeof row.detail, event.detail);
  LogRecord record{};
  record.kind = LogKind::event;
  return write(record, bytes_of(&row, sizeof row));
}

Outcome Recorder::Body::write(LogRecord record, const std::vector<std::byte>& payload) {
  empty = false;
  const int error = append(log, log_end, record, payload);
  return error == 0 ? Outcome(Done{}) : stop(std::strerror(error));
}

// The log stays unconverted, because a full disk has no room for an HDF5 file beside it.
Outcome Recorder::Body::stop(const std::string& why) {
  broken = "cannot write " + log_name.string() + ": " + why +
           "; recording ended, and `hapsix info " + file.string() +
           "` keeps what was written before";
  log = File();
  rows.clear();
  return Failure{broken};
}

Outcome Recorder::Body::finish(const std::string& summary_json) {
  if (Outcome can = usable(); !can) return can;
  if (!is_json_object(summary_json)) return refuse(file, "the summary is not one JSON object");
  if (Outcome written = write_rows(); !written) return written;
  LogRecord record{};
  record.kind = LogKind::summary;
  if (Outcome written = write(record, bytes_of(summary_json.data(), summary_json.size())); !written)
    return written;
  open = false;
  return publish(log, file, false);
}

// Ends without a summary.
void Recorder::Body::leave() {
  if (!open || !broken.empty()) return;
  if (empty && rows.empty()) {
    if (log.named(log_name)) ::unlink(log_name.c_str());
  } else if (write_rows()) {
    (void)publish(log, file, true);
  }
}

Recorder::Recorder(std::unique_ptr<Body> body) : body_(std::move(body)) {}

Recorder::~Recorder() {
  try {
    body_->leave();
  } catch (...) {  // out of memory: what is in the log stays
  }
}

Result<std::unique_ptr<Recorder>> Recorder::create(const fs::path& file,
                                                   const RecordingHead& head) {
  try {
    const fs::path place = followed(file);
    if (Outcome may = may_replace(place); !may) return may.failure();
    if (Outcome fine = check_head(file, head); !fine) return fine.failure();
    auto body = std::make_unique<Body>(place, head);
    if (Outcome created = body->create(head); !created) return created.failure();
    return std::unique_ptr<Recorder>(new Recorder(std::move(body)));
  } catch (const std::exception& problem) {
    return refuse(file, problem.what());
  }
}

Outcome Recorder::frames(const h6FrameRecord* records, std::size_t count, const double* bends) {
  return body_->guarded([&] { return body_->add(records, bends, count); });
}

Outcome Recorder::event(const RecordingEvent& event) {
  return body_->guarded([&] { return body_->write_event(event); });
}

Outcome Recorder::finish(const std::string& summary_json) {
  return body_->guarded([&] { return body_->finish(summary_json); });
}

}  // namespace h6::io
