// SPDX-License-Identifier: Apache-2.0
// record_ring.h - the records of frames on their way from the haptic thread to one slow reader.
//
//   frame --- room for a record? --- whole ring -----+
//                     | no                           |-- by frame number --> reader
//                     +--- inputs ring (240 B a hand)+
//
// A whole record takes 4 kB, and q of the bodies that bend stands in the same slot of a column
// beside it. Where a reader that is too slow leaves no room for one, the inputs of the frame are
// kept, so that a replay computes the frame and goes on after it.
#pragma once
#include "hapsix/hapsix.h"
#include "runtime/base/arena.h"
#include "sched/spsc_ring.h"

namespace h6 {

class RecordRing {
 public:
  // `records`: whole ones; `inputs`: further frames. All pages are touched here, so that the haptic
  // thread has no page faults. `modes`: numbers of q of all bodies that bend.
  RecordRing(std::size_t records, std::size_t inputs, std::size_t hands, std::size_t modes,
             const h6Allocator& allocator = {});
  // Whether there was memory for it.
  bool ready() const { return record_memory_.data && input_memory_.data && bend_memory_.data; }

  // Writer. Never waits. `bends` are `modes` numbers.
  void push(const h6FrameRecord& row, const double* bends);
  // Writer. Is there no room for a whole record now?
  bool full() { return whole_.full(); }

  // Reader. Moves up to `room` records out, in the order of frames, and returns how many. `bends`
  // gets (room x modes) numbers, NaN where only inputs were kept; or it is null.
  std::size_t pop(h6FrameRecord* out, double* bends, std::size_t room);

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
  void pop_whole(h6FrameRecord& out, double* bends);

  std::size_t hands_, each_;  // each_: entries a frame, also without a hand
  std::size_t modes_, records_;
  Buffer<h6FrameRecord> record_memory_;
  Buffer<Input> input_memory_;
  Buffer<double> bend_memory_;  // (records x modes), slots as in whole_
  sched::SpscRing<h6FrameRecord> whole_;
  sched::SpscRing<Input> inputs_;
  std::uint64_t pushed_ = 0;              // whole records so far; the writer's
  alignas(64) std::uint64_t popped_ = 0;  // the reader's
  std::uint64_t lost_ = 0, inputs_only_ = 0;
};

}  // namespace h6
