// SPDX-License-Identifier: Apache-2.0
// loop_view.h - what a viewer sees of a running loop: the newest poses and contacts, handed over in
// place. Neither side ever waits; what the viewer does not fetch in time is replaced.
#pragma once
#include <vector>

#include "hapsix/hapsix.h"
#include "sched/latest_value.h"

namespace h6 {

class LoopView {
 public:
  // `contacts`: rows at most.
  LoopView(std::size_t bodies, std::size_t contacts);
  // On the haptic thread, between two frames.
  void write(const h6Session& session, double time);
  // The viewer's thread. False when nothing is newer; what `out` points at stays until then.
  bool read(h6LoopView* out);

 private:
  struct Slot {
    std::uint64_t frame = 0;
    double time = 0;
    std::size_t contacts = 0, rows = 0;
    std::vector<h6Pose> body;
    std::vector<h6ViewContact> contact;
  };
  sched::LatestValue<Slot> slots_;
};

// `next` goes on where `before` is: poses, velocities, hands, and what their safety chains hold.
// Settings stay those of `next`. Both are of the same bodies and hands.
void take_over(h6Session& next, const h6Session& before);
bool may_take_over(const h6Session* next, const h6Session& before, h6Error* error);

}  // namespace h6
