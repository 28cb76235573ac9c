// SPDX-License-Identifier: Apache-2.0
// run_watch.cpp - turns the frames of a live run into its tally, its events and its recording.
#include "io/run/run_watch.h"

#include <algorithm>

namespace h6::cli {
namespace {

constexpr std::size_t kStripBins = 60, kMostEvents = 1000;

}  // namespace

RunWatch::RunWatch(const io::LoadedScene& loaded, double rate, RunSummary& summary,
                   io::Recorder* recorder)
    : summary_(summary),
      recorder_(recorder),
      tally_(loaded, rate, summary.seconds),
      late_(rate),
      hands_(loaded.hands.size()) {
  summary_.depth_strip.assign(kStripBins, 0);
  last_state_.fill(H6_ACTIVE);  // a device that is active from the start is no event
}

Outcome RunWatch::rows(const h6FrameRecord* rows, const double* bends, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) row(rows[i]);
  return recorder_ ? recorder_->frames(rows, count, bends) : Outcome(Done{});
}

void RunWatch::note(const std::string& what, const std::string& detail) {
  event({last_time_, what, "after frame " + std::to_string(frames_) + ": " + detail});
}

void RunWatch::finish(const io::Progress& progress) {
  late_.finish([this](const io::LateFrame& late) { note_late(late); });
  if (summary_.interrupted)
    event({last_time_, "interrupted", "by the user; every device was told to stop"});
  static_cast<RunTotals&>(summary_) = tally_.totals(progress);
  if (const auto& popped = summary_.through.first)
    event({popped->time, "through", sentence(*popped)});
  static_cast<RunTimes&>(summary_) = tally_.times();
}

void RunWatch::row(const h6FrameRecord& r) {
  if (frames_ == 0)
    for (const PartOverlap& o : summary_.overlaps) event({r.time, "overlap", o.sentence});
  ++frames_;
  last_time_ = r.time;
  note_gap(r);
  if (r.inputs_only) return;
  tally_.frame(r);
  const auto bin = static_cast<std::size_t>(kStripBins * r.time / summary_.seconds);
  if (bin < kStripBins)
    summary_.depth_strip[bin] =
        std::max(summary_.depth_strip[bin], static_cast<float>(r.report.max_depth_voxels));
  note_changes(r);
}

// Marks frames that the recorder was too slow for: in part, or altogether.
void RunWatch::note_gap(const h6FrameRecord& r) {
  const std::uint64_t frame = r.report.frame;
  if (frame > next_frame_)
    event({r.time, "frames lost",
           "frames " + std::to_string(next_frame_) + " to " + std::to_string(frame - 1) +
               ": the recorder was too slow, and a replay ends before them"});
  if (r.inputs_only && !in_gap_)
    event({r.time, "frames short",
           "from frame " + std::to_string(frame) +
               " on: the recorder was too slow, and only inputs are kept; a replay computes the "
               "rest"});
  if (!r.inputs_only && in_gap_)
    event({r.time, "frames whole again", "frame " + std::to_string(frame)});
  in_gap_ = r.inputs_only != 0;
  next_frame_ = frame + 1;
}

// Makes an event when a status bit or a cause appears, not while it stays. Some status bits make no
// event here: those of the safety chain, because its causes say more and name the hand, and that of
// late frames, because each late frame has an event of its own.
void RunWatch::note_changes(const h6FrameRecord& r) {
  const h6Status status =
      r.report.status &
      ~static_cast<h6Status>(H6_COUPLING_SATURATED | H6_OUTPUT_CLAMPED | H6_OUTPUT_SLEWED |
                             H6_OUTPUT_FAULT | H6_DEVICE_LOST | H6_LATE);
  const std::string frame = "frame " + std::to_string(r.report.frame);
  for (h6Status bit = 1; h6StatusName(bit); bit <<= 1)
    if ((status & bit) && !(last_status_ & bit)) event({r.time, h6StatusName(bit), frame});
  last_status_ = status;
  late_.row(r, [this](const io::LateFrame& late) { note_late(late); });
  for (std::size_t h = 0; h < hands_; ++h) note_hand(r, h, frame);
}

void RunWatch::note_late(const io::LateFrame& late) {
  ++summary_.late[static_cast<std::size_t>(late.cause)];
  event({late.time, std::string("late: ") + io::late_cause_name(late.cause), late.sentence()});
}

void RunWatch::note_hand(const h6FrameRecord& r, std::size_t h, const std::string& frame) {
  const std::string hand = "hand " + std::to_string(h) + ", " + frame;
  const std::uint32_t causes = r.command[h].causes, fresh = causes & ~last_causes_[h];
  for (int c = 1; c < H6_CAUSE_COUNT; ++c)
    if (fresh >> c & 1u) event({r.time, h6CauseName(static_cast<h6Cause>(c)), hand});
  last_causes_[h] = causes;
  if (r.state[h] == last_state_[h]) return;
  const std::string was = h6DeviceStateName(last_state_[h]);
  last_state_[h] = r.state[h];
  event({r.time, std::string("device ") + h6DeviceStateName(r.state[h]), hand + ", was " + was});
}

void RunWatch::event(const io::RecordingEvent& e) {
  if (summary_.events.size() < kMostEvents)
    summary_.events.push_back(e);
  else
    ++summary_.events_dropped;
  if (recorder_) (void)recorder_->event(e);
}

}  // namespace h6::cli
