// SPDX-License-Identifier: Apache-2.0
// record_ring.h - the records of frames on their way from the haptic thread to one slow reader.
//
//   frame --- room for a record? --- whole ring -----+
//                     | no                           |-- by frame number --> reader
//                     +--- inputs ring (240 B a hand)+
//
// A whole record takes 4 kB. Where a reader that is too slow leaves no room for one, the inputs of
// the frame are kept, so that a replay computes the frame and goes on after it.
#pragma once
#include "hapsix/hapsix.h"
#include "runtime/base/arena.h"
#include "sched/spsc_ring.h"

namespace h6 {

class RecordRing {
 public:
  // `records`: whole ones; `inputs`: further frames. All pages are touched here, so that the haptic
  // thread has no page faults.
  RecordRing(std::size_t records, std::size_t inputs, std::size_t hands,
             const h6Allocator& allocator = {});
  // Whether there was memory for it.
  bool ready() const { return record_memory_.data && input_memory_.data; }

  // Writer. Never waits.
  void push(const h6FrameRecord& row);
  // Writer. Is there no room for a whole record now?
  bool full() { return whole_.full(); }

  // Reader. Moves up to `room` records out, in the order of frames, and returns how many.
  std::size_t pop(h6FrameRecord* out, std::size_t room);

  // After the writer has ended.
  std::uint64_t lost() const { return lost_; }
  std::uint64_t inputs_only() const { return inputs_only_; }

 private:
  // One for each hand of a frame, in turn.
  struct Input {
    double time;
    std::uint64_t frame;
    std::uint32_t settings, coarse_pairs, coarse_points;
    h6Cause cause;
    std::uint32_t causes;
    h6DeviceSample hand;
    h6SafetyInput safety;
  };
  void pop_inputs(h6FrameRecord& out);

  std::size_t hands_, each_;  // each_: entries a frame, also without a hand
  Buffer<h6FrameRecord> record_memory_;
  Buffer<Input> input_memory_;
  sched::SpscRing<h6FrameRecord> whole_;
  sched::SpscRing<Input> inputs_;
  std::uint64_t lost_ = 0, inputs_only_ = 0;
};

}  // namespace h6
