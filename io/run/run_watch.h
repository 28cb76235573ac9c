// SPDX-License-Identifier: Apache-2.0
// run_watch.h - turns the frames of a live run into its tally, its events and its recording.
#pragma once
#include <array>
#include <string>

#include "io/record/late_judge.h"
#include "io/run/run_scene.h"
#include "io/run/run_tally.h"

namespace h6::cli {

class RunWatch {
 public:
  // Fills `summary`. `rate` is in frames per second. `recorder` may be null.
  RunWatch(const io::LoadedScene& loaded, double rate, RunSummary& summary, io::Recorder* recorder);
  // `bends`: q of all bodies that bend, a row for each frame.
  Outcome rows(const h6FrameRecord* rows, const double* bends, std::size_t count);
  // Adds an event that the frames do not show.
  void note(const std::string& what, const std::string& detail);
  // Judges the run, which may take a while.
  void finish(const io::Progress& progress);

 private:
  void row(const h6FrameRecord& record);
  void note_gap(const h6FrameRecord& record);
  void note_changes(const h6FrameRecord& record);
  void note_late(const io::LateFrame& late);
  void note_hand(const h6FrameRecord& record, std::size_t hand, const std::string& frame);
  void event(const io::RecordingEvent& event);

  RunSummary& summary_;
  io::Recorder* recorder_;
  RunTally tally_;
  io::LateJudge late_;
  std::size_t hands_;
  std::uint64_t frames_ = 0, next_frame_ = 0;
  bool in_gap_ = false;  // the last row had only inputs
  double last_time_ = 0;
  h6Status last_status_ = 0;
  std::array<std::uint32_t, H6_MAX_HANDS> last_causes_{};
  std::array<h6DeviceState, H6_MAX_HANDS> last_state_{};
};

}  // namespace h6::cli
