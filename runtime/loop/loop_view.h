// SPDX-License-Identifier: Apache-2.0
// loop_view.h - hands the newest poses and contacts of a running loop to a viewer, in place.
// Neither side ever waits; a value that the viewer does not fetch in time is replaced.
#pragma once
#include <cstddef>
#include <cstdint>

#include "hapsix/hapsix.h"
#include "sched/host_memory.h"
#include "sched/latest_value.h"

namespace h6 {

class LoopView {
 public:
  // `contacts`: the most rows that a viewer gets.
  LoopView(const h6Session& session, std::size_t contacts);
  // For the haptic thread, between two frames.
  void write(const h6Session& session, double time);
  // For the viewer's thread. False when nothing is newer. `out` points into a slot that stays valid
  // until a later call returns true.
  bool read(h6LoopView* out);

 private:
  struct Slot {
    std::uint64_t frame = 0;
    double time = 0;
    std::size_t contacts = 0, rows = 0;
    sched::HostVector<h6Pose> body;
    sched::HostVector<h6ViewContact> contact;
    sched::HostVector<double> bend;
  };
  sched::LatestValue<Slot> slots_;
};

// Lets `next` go on where `before` is: poses, velocities, hands and their safety chains. Settings
// stay those of `next`. Both sessions have the same bodies and hands.
void take_over(h6Session& next, const h6Session& before);
// Two sessions can take turns in a loop if their kinds are equal. A loop keeps the kind, so that
// nobody but the haptic thread looks at the loop's session.
struct SessionKind {
  const h6Model* model = nullptr;
  std::size_t bodies = 0, hands = 0;
  double dt = 0;
  std::int32_t body[H6_MAX_HANDS] = {};
  std::uint32_t mode[H6_MAX_HANDS] = {};
};
SessionKind kind_of(const h6Session& session);
bool may_take_over(const h6Session* next, const SessionKind& before, h6Error* error);

}  // namespace h6
