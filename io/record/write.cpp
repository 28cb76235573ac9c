// SPDX-License-Identifier: Apache-2.0
// write.cpp - the recorder: rows to HDF5 in memory, then published as one change.
//
//   frames() -> pending rows --- a quarter second ---> HDF5 (Image) -> flush -> Copies::publish
//
// A segment is one chunk of every dataset, so a chunk is compressed once and never grows on disk.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <system_error>

#include "io/record/copies.h"
#include "io/record/image.h"
#include "io/record/layout.h"

namespace h6::io {
namespace fs = std::filesystem;
using namespace recording;
using Clock = std::chrono::steady_clock;

namespace {

constexpr auto longest_wait = std::chrono::milliseconds(300);  // of a row before it is written
constexpr double longest_span = 0.3;                           // [s] of recorded time
constexpr std::size_t events_per_chunk = 16;
constexpr std::size_t longest_segment = 4096;  // rows; bounds memory

bool is_json_object(const std::string& text) {
  const auto parsed = nlohmann::json::parse(text, nullptr, false);
  return parsed.is_object();
}

// Attributes: text, list of texts, number. Each false when the library fails.
bool put_text(hid_t at, const char* name, const std::string& text) {
  const Handle type = text_type(), space = H5Screate(H5S_SCALAR);
  const Handle made = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  const char* chars = text.c_str();
  return made.ok() && H5Awrite(made, type, &chars) >= 0;
}

bool put_texts(hid_t at, const char* name, const std::vector<std::string>& texts) {
  const hsize_t count = texts.size();
  const Handle type = text_type(), space = H5Screate_simple(1, &count, nullptr);
  const Handle made = H5Acreate2(at, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
  std::vector<const char*> chars;
  for (const std::string& text : texts) chars.push_back(text.c_str());
  return made.ok() && (chars.empty() || H5Awrite(made, type, chars.data()) >= 0);
}

bool put_number(hid_t at, const char* name, hid_t disk, hid_t memory, const void* number) {
  const Handle space = H5Screate(H5S_SCALAR);
  const Handle made = H5Acreate2(at, name, disk, space, H5P_DEFAULT, H5P_DEFAULT);
  return made.ok() && H5Awrite(made, memory, number) >= 0;
}

// One text of its own length, whatever that is; what read_recording reads.
bool put_whole(hid_t group, const std::string& text) {
  const hsize_t one = 1;
  const Handle type = fixed_text_type(text.size()), space = H5Screate_simple(1, &one, nullptr);
  const Handle made =
      H5Dcreate2(group, "whole", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  return made.ok() && H5Dwrite(made, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.c_str()) >= 0;
}

std::string whole_head(const RecordingHead& head) {
  const nlohmann::json all = {{"version", format_version},
                              {"json", head.scene_json},
                              {"asset_hashes", head.asset_hashes},
                              {"simd_target", head.simd_target},
                              {"program", head.program},
                              {"rate", head.rate},
                              {"hands", head.hands},
                              {"run", head.run_json}};
  return all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

bool put_head(hid_t file, const RecordingHead& head) {
  const Handle config = H5Gcreate2(file, "config", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const auto hands = static_cast<std::uint32_t>(head.hands);
  return config.ok() && put_whole(config, whole_head(head)) &&
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

// A dataset without rows yet that grows along its first dimension.
Handle make_dataset(hid_t group, const char* name, hid_t type, std::vector<hsize_t> chunk) {
  std::vector<hsize_t> now = chunk, most = chunk;
  now[0] = 0, most[0] = H5S_UNLIMITED;
  const Handle space = H5Screate_simple(static_cast<int>(now.size()), now.data(), most.data());
  const Handle how = H5Pcreate(H5P_DATASET_CREATE);
  if (H5Pset_chunk(how, static_cast<int>(chunk.size()), chunk.data()) < 0) return {};
  if (H5Zfilter_avail(H5Z_FILTER_DEFLATE) > 0 &&
      (H5Pset_shuffle(how) < 0 || H5Pset_deflate(how, 1) < 0))
    return {};
  return H5Dcreate2(group, name, type, space, H5P_DEFAULT, how, H5P_DEFAULT);
}

// Writes `count` rows behind the `have` that are there.
bool append(hid_t dataset, hid_t memory_type, std::vector<hsize_t> block, hsize_t have,
            const void* rows) {
  std::vector<hsize_t> total = block, start(block.size(), 0);
  total[0] = have + block[0], start[0] = have;
  if (H5Dset_extent(dataset, total.data()) < 0) return false;
  const int rank = static_cast<int>(block.size());
  const Handle memory = H5Screate_simple(rank, block.data(), nullptr);
  const Handle disk = H5Dget_space(dataset);
  return H5Sselect_hyperslab(disk, H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr) >=
             0 &&
         H5Dwrite(dataset, memory_type, memory, disk, H5P_DEFAULT, rows) >= 0;
}

// Cut or filled with NULs to `bytes`; a cut does not leave half a UTF-8 character.
std::string padded(std::string text, std::size_t bytes) {
  if (text.size() > bytes) {
    std::size_t end = bytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    text.resize(end);
  }
  text.resize(bytes, '\0');
  return text;
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
  if (fs::file_size(file, failed) == 0 || H5Fis_hdf5(file.c_str()) > 0) return Done{};
  return refuse(file, "a file that is not a recording is there; choose another name");
}

Outcome check_head(const fs::path& file, const RecordingHead& head) {
  if (head.hands < 1 || head.hands > H6_MAX_HANDS)
    return refuse(file, std::to_string(head.hands) + " hands; 1 to " +
                            std::to_string(H6_MAX_HANDS) + " can be recorded");
  if (!(head.rate > 0 && head.rate <= 1e6))
    return refuse(file, "the rate must be above 0 and at most 1000000 Hz");
  if (!head.scene_json.empty() && !is_json_object(head.scene_json))
    return refuse(file, "the scene is not one JSON object");
  return Done{};
}

}  // namespace

struct Recorder::Body {
  explicit Body(fs::path place, std::size_t hand_count, double rate)
      : file(std::move(place)), hands(hand_count), copies(file) {
    const double quarter = std::clamp(rate / 4, 16.0, static_cast<double>(longest_segment));
    segment = static_cast<std::size_t>(quarter);
  }

  fs::path file;
  std::size_t hands, segment;
  Image image;  // outlives the handles, which write to it when they close
  Copies copies;
  Handle h5, times, whats, details;
  std::vector<Handle> datasets;  // in the order of columns()

  std::vector<h6FrameRecord> pending;
  std::vector<RecordingEvent> pending_events;
  Clock::time_point waiting_since;  // of the oldest pending row or event
  hsize_t rows = 0, events = 0;     // in HDF5
  double written_until = 0;         // [s] of recorded time
  bool open = false;
  std::string broken;  // the sentence of the failure that ended recording
  std::vector<std::byte> packed;

  Outcome create(const RecordingHead& head);
  bool create_hdf5(const RecordingHead& head);
  bool create_events();
  Outcome add(const h6FrameRecord* records, std::size_t count);
  Outcome write_due();
  Outcome write(std::size_t count);
  bool append_rows(std::size_t count);
  bool append_events();
  Outcome publish();
  Outcome stop(const std::string& sentence);
  Outcome finish(const std::string& summary_json);
  void leave();
  void close_hdf5();
  bool nothing_recorded() const {
    return rows == 0 && events == 0 && pending.empty() && pending_events.empty();
  }
};

Outcome Recorder::Body::create(const RecordingHead& head) {
  if (!create_hdf5(head) || H5Fflush(h5, H5F_SCOPE_GLOBAL) < 0)
    return refuse(file, library_reason());
  const Change first = image.take();
  if (Outcome started = copies.start(first); !started) return started;
  image.rebase(copies.base());
  open = true;
  return Done{};
}

bool Recorder::Body::create_hdf5(const RecordingHead& head) {
  const Handle access = static_cast<hid_t>(image_access(&image));
  // Small chunk caches: a chunk is complete when it is written. The oldest format: MATLAB reads it.
  if (!access.ok() || H5Pset_cache(access, 0, 101, std::size_t{256} << 10, 1.0) < 0) return false;
  h5 = H5Fcreate("recording", H5F_ACC_TRUNC, H5P_DEFAULT, access);
  if (!h5.ok() || !put_head(h5, head)) return false;
  const Handle frames = H5Gcreate2(h5, "frames", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  for (const Column& column : columns()) {
    datasets.push_back(
        make_dataset(frames, column.name, cell_type(column.cell), shape(column, segment, hands)));
    const hid_t made = datasets.back();
    if (made < 0 || !put_text(made, "units", column.units) ||
        !put_text(made, "columns", column.labels))
      return false;
  }
  return create_events();
}

bool Recorder::Body::create_events() {
  const Handle group = H5Gcreate2(h5, "events", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const Handle what = fixed_text_type(event_what_bytes);
  const Handle detail = fixed_text_type(event_detail_bytes);
  times = make_dataset(group, "t", H5T_IEEE_F64LE, {events_per_chunk});
  whats = make_dataset(group, "what", what, {events_per_chunk});
  details = make_dataset(group, "detail", detail, {events_per_chunk});
  return times.ok() && whats.ok() && details.ok() && put_text(times, "units", "s");
}

Outcome Recorder::Body::add(const h6FrameRecord* records, std::size_t count) {
  if (!broken.empty()) return Failure{broken};
  if (!open) return refuse(file, "this recording is finished");
  while (count > 0) {
    const std::size_t part = std::min(count, longest_segment);
    if (pending.empty() && pending_events.empty()) waiting_since = Clock::now();
    pending.insert(pending.end(), records, records + part);
    records += part, count -= part;
    if (Outcome written = write_due(); !written) return written;
  }
  return write_due();
}

// Whole chunks as soon as there are any; the rest when it has waited long enough.
Outcome Recorder::Body::write_due() {
  if (const std::size_t whole = pending.size() - pending.size() % segment; whole > 0)
    if (Outcome written = write(whole); !written) return written;
  if (pending.empty() && pending_events.empty()) return Done{};
  const bool waited = Clock::now() - waiting_since >= longest_wait;
  const bool spans = !pending.empty() && pending.back().time - written_until >= longest_span;
  return waited || spans ? write(pending.size()) : Outcome(Done{});
}

Outcome Recorder::Body::write(std::size_t count) {
  if (!append_rows(count) || !append_events())
    return stop("cannot write " + file.string() + ": " + library_reason());
  pending.erase(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(count));
  pending_events.clear();
  waiting_since = Clock::now();  // what is left has just come
  return publish();
}

bool Recorder::Body::append_rows(std::size_t count) {
  if (count == 0) return true;
  for (std::size_t i = 0; i < datasets.size(); ++i) {
    const Column& column = columns()[i];
    pack(column, hands, pending.data(), count, packed);
    if (!append(datasets[i], cell_type(column.cell), shape(column, count, hands), rows,
                packed.data()))
      return false;
  }
  rows += count;
  written_until = pending[count - 1].time;
  return true;
}

bool Recorder::Body::append_events() {
  if (pending_events.empty()) return true;
  std::vector<double> t;
  std::string what, detail;
  for (const RecordingEvent& event : pending_events) {
    t.push_back(event.time);
    what += padded(event.what, event_what_bytes);
    detail += padded(event.detail, event_detail_bytes);
  }
  const std::vector<hsize_t> block = {t.size()};
  const Handle what_type = fixed_text_type(event_what_bytes);
  const Handle detail_type = fixed_text_type(event_detail_bytes);
  if (!append(times, H5T_NATIVE_DOUBLE, block, events, t.data()) ||
      !append(whats, what_type, block, events, what.data()) ||
      !append(details, detail_type, block, events, detail.data()))
    return false;
  events += t.size();
  return true;
}

Outcome Recorder::Body::publish() {
  if (H5Fflush(h5, H5F_SCOPE_GLOBAL) < 0)
    return stop("cannot write " + file.string() + ": " + library_reason());
  if (Outcome published = copies.publish(image.take()); !published) return stop(published.error());
  image.rebase(copies.base());
  return Done{};
}

Outcome Recorder::Body::stop(const std::string& sentence) {
  broken = sentence + "; recording ended, what was written before is kept";
  close_hdf5();
  copies.drop_spare();
  pending.clear();
  pending_events.clear();
  return Failure{broken};
}

Outcome Recorder::Body::finish(const std::string& summary_json) {
  if (!broken.empty()) return Failure{broken};
  if (!open) return refuse(file, "this recording is finished");
  if (!is_json_object(summary_json)) return refuse(file, "the summary is not one JSON object");
  if (!append_rows(pending.size()) || !append_events())
    return stop("cannot write " + file.string() + ": " + library_reason());
  pending.clear();
  pending_events.clear();
  {
    const Handle group = H5Gcreate2(h5, "summary", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (!group.ok() || !put_whole(group, summary_json) || !put_text(group, "json", summary_json))
      return stop("cannot write " + file.string() + ": " + library_reason());
  }
  if (Outcome published = publish(); !published) return published;
  open = false;
  close_hdf5();
  return copies.finish();
}

// Ends without a summary.
void Recorder::Body::leave() {
  if (open && broken.empty()) {
    if (nothing_recorded())
      copies.abandon();
    else if (!pending.empty() || !pending_events.empty())
      (void)write(pending.size());
    copies.drop_spare();
  }
  close_hdf5();
}

void Recorder::Body::close_hdf5() {
  for (Handle& dataset : datasets) dataset.close();
  for (Handle* handle : {&times, &whats, &details, &h5}) handle->close();
}

Recorder::Recorder(std::unique_ptr<Body> body) : body_(std::move(body)) {}

Recorder::~Recorder() {
  try {
    const LibraryLock lock;
    body_->leave();
    body_.reset();
  } catch (...) {  // out of memory: what is published stays
  }
}

Result<std::unique_ptr<Recorder>> Recorder::create(const fs::path& file,
                                                   const RecordingHead& head) {
  try {
    const fs::path place = followed(file);
    std::error_code ignored;
    if (fs::exists(part_of(place), ignored) || fs::exists(swap_of(place), ignored))
      (void)repair_recording(place);  // a killed run may have left its only copy there
    const LibraryLock lock;
    if (Outcome may = may_replace(place); !may) return may.failure();
    if (Outcome fine = check_head(file, head); !fine) return fine.failure();
    auto body = std::make_unique<Body>(place, head.hands, head.rate);
    if (Outcome created = body->create(head); !created) {
      body->close_hdf5();
      return created.failure();
    }
    return std::unique_ptr<Recorder>(new Recorder(std::move(body)));
  } catch (const std::exception& problem) {
    return refuse(file, problem.what());
  }
}

Outcome Recorder::frames(const h6FrameRecord* records, std::size_t count) {
  const LibraryLock lock;
  try {
    return body_->add(records, count);
  } catch (const std::exception& problem) {
    return body_->stop("cannot record to " + body_->file.string() + ": " + problem.what());
  }
}

Outcome Recorder::event(const RecordingEvent& event) {
  const LibraryLock lock;
  try {
    Body& body = *body_;
    if (!body.broken.empty() || !body.open) return body.add(nullptr, 0);
    if (body.pending.empty() && body.pending_events.empty()) body.waiting_since = Clock::now();
    body.pending_events.push_back(event);
    return body.write_due();
  } catch (const std::exception& problem) {
    return body_->stop("cannot record to " + body_->file.string() + ": " + problem.what());
  }
}

Outcome Recorder::finish(const std::string& summary_json) {
  const LibraryLock lock;
  try {
    return body_->finish(summary_json);
  } catch (const std::exception& problem) {
    return body_->stop("cannot finish " + body_->file.string() + ": " + problem.what());
  }
}

}  // namespace h6::io
