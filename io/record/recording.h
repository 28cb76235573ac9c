// SPDX-License-Identifier: Apache-2.0
// recording.h - runs as HDF5, for h5py and MATLAB; a killed run loses at most its last half second.
//
// OUT.h5 is a complete, closed HDF5 file at every instant of the run: what is new goes to a second
// copy, OUT.h5.part, which then swaps names with it. After a kill it opens as it is, in any tool.
// A file that was there before stays as OUT.h5.before until the new recording is finished; it is
// then replaced. A run that is killed, fails or records nothing never costs an older file.
//
// /frames/{t, frame, status, late, hash, contacts, max_depth, max_depth_voxels, net_stiffness,
// stage_us, frame_us, wakeup_us, settings} (n) or (n, width), /frames/{hand_pose, hand_velocity,
// hand_wrench, buttons, sequence, body_pose, body_velocity, wrench, command_pose, cause, causes,
// state, safety_asked, overdue} (n, hands) or (n, hands, width), with units and column names as
// attributes; /config, /events/{t, what, detail}, /summary. Numbers come back to the bit. The
// gravest cause and all of them, the device's state, and what its safety chain was told from
// outside are there for every frame; an event is there when one of them comes up. /config and
// /summary keep their attributes a second time, as the text that read_recording takes.
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

// Everything but frames: kept as JSON and attributes under /config.
struct RecordingHead {
  std::string scene_json;                 // the scene, as one JSON object; may be empty
  std::vector<std::string> asset_hashes;  // of fields and shells
  std::string simd_target;                // kernels in use, "AVX3"
  double rate = 1000;                     // [Hz]
  std::size_t hands = 1;
  std::string program;   // name and version
  std::string run_json;  // how it was run, recorded_run.h; may be empty
};

struct RecordingEvent {
  double time;         // [s]
  std::string what;    // cause or status name; cut after 64 bytes
  std::string detail;  // cut after 512 bytes
};

// Used from one thread, never the haptic one. Frames are buffered and written in flushed segments
// at least every half second of recorded or wall time, whichever comes first: a quarter second of
// frames at once, or what has waited for 0.3 s. It has no thread of its own, so call frames() at
// least every 50 ms, with count 0 when there is nothing new. Memory does not grow with the run.
class Recorder {
 public:
  // Fails when `file` is something else than a recording or an empty file: that is not replaced.
  static Result<std::unique_ptr<Recorder>> create(const std::filesystem::path& file,
                                                  const RecordingHead& head);
  // Writes what was handed over; without finish() the recording says that the run did not end.
  // With no frame and no event at all, the older file is back as if nothing had been.
  ~Recorder();
  // After a failure (a full disk) nothing more is written, each call gives the same sentence, and
  // the frames up to then stay readable.
  Outcome frames(const h6FrameRecord* records, std::size_t count);
  Outcome event(const RecordingEvent& event);
  // Key and value pairs for /summary, as JSON text; then closes the file.
  Outcome finish(const std::string& summary_json);

 private:
  struct Body;
  explicit Recorder(std::unique_ptr<Body> body);
  std::unique_ptr<Body> body_;
};

struct Recording {
  RecordingHead head;
  std::vector<h6FrameRecord> frames;
  std::vector<RecordingEvent> events;
  std::string summary_json;       // empty: the run did not end
  bool whole = true;              // false: the run was killed; frames up to the last flush are here
  std::string remark;             // what was repaired or is missing, one sentence; empty: nothing
  std::uint64_t frame_count = 0;  // in the file; `frames` has those of the range asked for
  // Of /frames that the file has: older ones lack some, and `frames` has zeros there.
  std::vector<std::string> columns;
};

// A frame takes over 2 kB in memory: long recordings can be read in pieces.
struct FrameRange {
  std::uint64_t first = 0;
  std::uint64_t count = UINT64_MAX;  // cut at the end
};
// Also while the run goes on, best from another process: HDF5 serves one thread at a time, and a
// recorder in this one waits for it. Where `file` is damaged or gone, the copy beside it is read.
Result<Recording> read_recording(const std::filesystem::path& file, FrameRange range = {});

// The first number in which two rows of one frame differ, in the order a frame makes them:
// contacts, depths, bodies, what hands are told, the hash. Times and status are not looked at.
struct RowDifference {
  std::string column, cell;  // "body_pose", "qz"
  std::size_t hand = 0;      // of columns with one row a hand
  double a = 0, b = 0;       // as numbers; of hashes only the leading digits
};
// `commands` false: what hands are told is not looked at; it depends on deadlines too.
std::optional<RowDifference> first_difference(const h6FrameRecord& a, const h6FrameRecord& b,
                                              std::size_t hands, bool commands);

// Makes `file` the newest whole copy of a run that was killed and removes what else that run left
// beside it. Changes nothing where there is nothing to do, or where a run may still be going on
// (files younger than five seconds). A damaged file is kept as FILE.damaged. Says what it did;
// empty: nothing.
Result<std::string> repair_recording(const std::filesystem::path& file);

}  // namespace h6::io
