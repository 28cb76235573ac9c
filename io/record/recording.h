// SPDX-License-Identifier: Apache-2.0
// recording.h - runs as HDF5, for h5py and MATLAB; a killed run loses at most its last half second.
//
// While a run goes on, its frames are appended to OUT.h5.part, a log of our own. At the end the log
// becomes OUT.h5, written aside and renamed, and is removed. A killed run leaves its log, and
// read_recording and repair_recording turn it into OUT.h5. An existing OUT.h5 stays unchanged until
// the new recording is finished and replaces it, so a run that is killed, fails or records nothing
// never costs an older file. None of this covers a power cut, because the log is not synced to the
// disk.
//
// /frames/{t, frame, status, late, hash, contacts, max_depth, max_depth_voxels, net_stiffness,
// stage_us, frame_us, wakeup_us, settings, substeps, inputs_only, seal} (n) or (n, width),
// /frames/{hand_pose, hand_velocity, hand_wrench, buttons, sequence, body_pose, body_velocity,
// wrench, command_pose, cause, causes, state, safety_asked, overdue} (n, hands) or (n, hands,
// width), with units and column names as attributes; /config, /events/{t, what, detail, seal},
// /summary. Each body that bends has /frames/bend_N (n, r), its coordinates q; N is its index in
// the scene. Numbers are read back bit for bit. Every frame has the gravest cause and all causes,
// the device's state, and the inputs of its safety chain. An event marks the first frame of each
// cause. /config and /summary hold their attributes a second time, as the text that read_recording
// reads.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"

namespace h6::io {
namespace recording {
struct Column;
}

// A body whose shell bends.
struct RecordedBend {
  std::uint32_t body;  // index in the scene
  std::string name;
  std::size_t modes;  // r, 1 .. H6_MAX_MODES
};

std::size_t modes_of(const std::vector<RecordedBend>& bends);  // of all together

// The facts about a run that do not change with the frames: JSON and attributes under /config.
struct RecordingHead {
  std::string scene_json;                 // the scene, as one JSON object; may be empty
  std::vector<std::string> asset_hashes;  // of fields and shells
  std::string simd_target;                // kernels in use, "AVX3"
  double rate = 1000;                     // [Hz]
  std::size_t hands = 1;
  std::string program;              // name and version
  std::string run_json;             // how it was run, see recorded_run.h; may be empty
  std::vector<RecordedBend> bends;  // in the order of bodies; older files have none
};

struct RecordingEvent {
  double time;         // [s]
  std::string what;    // cause or status name; cut after 64 bytes
  std::string detail;  // cut after 512 bytes
};

// Used from one thread, never the haptic one. Rows are compressed and appended a quarter of a
// second at a time, and after 0.3 s of recorded or wall time at the latest; events are appended at
// once. The recorder has no thread of its own, so call frames() at least every 50 ms, with count 0
// when there is nothing new. Its memory does not grow with the run.
class Recorder {
 public:
  // Fails when `file` is neither a recording nor empty, and while another run records to it. A log
  // that a killed run left becomes `file` first.
  static Result<std::unique_ptr<Recorder>> create(const std::filesystem::path& file,
                                                  const RecordingHead& head);
  // Without finish() the recording says that the run did not end, and an older file is kept as
  // FILE.before. With no frame and no event nothing is written, and the older file stays.
  ~Recorder();
  // After a failure (a full disk) nothing more is written and each call gives the same sentence;
  // the frames before it stay in the log and can be read.
  // `bends`: (count x all modes) q of the bodies that bend [m sqrt(kg)]; null: NaN is recorded.
  Outcome frames(const h6FrameRecord* records, std::size_t count, const double* bends = nullptr);
  Outcome event(const RecordingEvent& event);
  // `summary_json` is one JSON object, for /summary. Makes the HDF5 file: some 2 s for an hour.
  Outcome finish(const std::string& summary_json);

 private:
  struct Body;
  explicit Recorder(std::unique_ptr<Body> body);
  std::unique_ptr<Body> body_;
};

struct Recording {
  RecordingHead head;
  std::vector<h6FrameRecord> frames;
  std::vector<double> bends;  // (frames x all modes) q; NaN where it is not known  [m sqrt(kg)]
  std::vector<RecordingEvent> events;
  std::string summary_json;       // empty: the run did not end
  bool whole = true;              // false: the run did not end; the frames up to then are here
  std::string remark;             // what was repaired or is missing, one sentence; may be empty
  std::uint64_t frame_count = 0;  // in the file; `frames` has those of the range asked for
  // Of /frames in the file. Older files lack some; `frames` has zeros there.
  std::vector<std::string> columns;
  std::vector<std::uint64_t> seals;  // one for each of `frames`; empty where the file has none
  bool sealed = false;               // head, events and summary have seals; older files lack them
  std::string unsealed;  // the first of them that does not fit its seal: "event 3"; or empty
};

// A frame takes over 2 kB in memory: long recordings can be read in pieces.
struct FrameRange {
  std::uint64_t first = 0;
  std::uint64_t count = UINT64_MAX;  // cut at the end
};
// `file` is OUT.h5 or OUT.h5.part. A log that a killed run left is turned into OUT.h5 first, see
// repair_recording. While the run goes on, and where OUT.h5 cannot be written, each call converts
// the log into a temporary file and reads that.
Result<Recording> read_recording(const std::filesystem::path& file, FrameRange range = {});

// The first number that a replay computes and that differs from the recorded one, in the order in
// which a frame computes them: time, contacts, depths, bodies, commands to the hands, states of the
// devices, status, the hash. Inputs, measured times, and the bits of status that depend on them
// (late, device lost) cannot be computed.
struct RowDifference {
  std::string column, cell;  // "body_pose", "qz"
  std::size_t hand = 0;      // of columns with one row a hand
  double a = 0, b = 0;       // as numbers; of hashes only the leading digits
};
class RowComparison {
 public:
  // `columns`: of the recording; only these are compared. Without the inputs of the safety chain
  // (older recordings), commands and states are left out.
  RowComparison(const RecordingHead& head, const std::vector<std::string>& columns);
  // `bends`: the rows' q of all bodies that bend. Where the recorded one is not known, it is left
  // out.
  std::optional<RowDifference> first(const h6FrameRecord& recorded, const double* recorded_bends,
                                     const h6FrameRecord& replayed,
                                     const double* replayed_bends) const;

 private:
  std::size_t hands_;
  std::shared_ptr<const std::vector<recording::Column>> columns_;  // that are compared, in order
};

// Compares the attributes of `file`, which other programs read, with the texts of `recording` that
// they repeat, and units and column names with those that this version writes. Returns the first
// that differs, "the attribute rate of /config", or nothing. Attributes that the file lacks, or has
// besides, are no difference. Fails when the file cannot be read.
Result<std::string> first_changed_attribute(const std::filesystem::path& file,
                                            const Recording& recording);

// Turns the log that a killed run left beside `file` into `file`; an older file there is kept as
// FILE.before (.before-2, ...). A log that is cut off or damaged gives the frames before that
// place. Returns what was done in one sentence, or nothing when there is no log or a run still
// writes it.
Result<std::string> repair_recording(const std::filesystem::path& file);

}  // namespace h6::io
