// SPDX-License-Identifier: Apache-2.0
// late_judge.h - tells afterwards what made a frame late.
//
// A thread's CPU clock goes on while a hypervisor or firmware holds the processor, so a frame of a
// stalled machine looks like work of its own. Its neighbours tell: frames with at least as much to
// do, of which none was nearly as dear, show that the work was not.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>

#include "hapsix/hapsix.h"

namespace h6::io {

enum class LateCause {
  own,      // own work; its like take at least half as long
  machine,  // the CPU clock says own work, but four times the dearest of its like would be in time
  doubt,    // the CPU clock says own work, and its neighbours do not tell
  stolen,   // it waited for the processor
  wakeup    // it began too late
};
const char* late_cause_name(LateCause cause);  // "own computation"

struct LateFrame {
  double time = 0;  // [s]
  std::uint64_t frame = 0;
  LateCause cause = LateCause::doubt;
  double late_us = 0, wakeup_us = 0, cpu_us = 0, frame_us = 0;
  std::size_t like = 0;  // of own, machine, doubt: how many neighbours had at least as much to do
  double like_us = 0;    // the most CPU time that one of them took
  double again_us = -1;  // the same frame, stepped again afterwards; negative: it was not
  // Sets again_us. A doubt ends where the frame takes over a period again, or less than half of
  // one.
  void stepped_again(double us, double period_us);
  std::string sentence() const;
};

class LateJudge {
 public:
  using Tell = std::function<void(const LateFrame&)>;
  // `rate` in frames per second.
  explicit LateJudge(double rate) : period_us_(1e6 / rate) {}
  // Takes rows in order and tells of each late frame once the kNear frames behind it are known.
  void row(const h6FrameRecord& row, const Tell& tell);
  // No more rows come.
  void finish(const Tell& tell);

  static constexpr std::size_t kNear = 64;  // frames before and behind

 private:
  struct Row {
    LateFrame frame;
    std::uint32_t late = 0, contacts = 0, substeps = 0;
  };
  void judge(std::size_t at, const Tell& tell) const;
  double period_us_;
  std::deque<Row> rows_;     // the newest, up to 2 kNear + 1
  std::size_t waiting_ = 0;  // how many of them are not judged
};

}  // namespace h6::io
