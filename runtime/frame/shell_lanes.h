// SPDX-License-Identifier: Apache-2.0
// shell_lanes.h - shares the shell bodies of a frame out: either both threads weigh one after the
// other, or each thread weighs its own.
//
// Two hands usually hold two parts. Traversal, contacts and weights of one shell body need nothing
// of another, so two shell bodies can be weighed side by side. Each has a lane with its own scratch
// and report. Wrenches are added afterwards, in order, so the bits are those of one thread.
#pragma once
#include "runtime/contact/lane.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"

namespace h6 {

struct Lanes {
  Scratch scratch[2];         // one for each thread
  Lane whole;                 // both threads share the slices and pairs of one shell body
  Lane single[2];             // one thread each
  bool two = false;           // the single lanes can be used
  bool side_by_side = false;  // they were, in this frame
};

// lanes.scratch must be laid out. `alone` is a team of one thread, or null if there is only one
// shell body.
void open_lanes(Lanes& lanes, sched::FrameTeam* team, sched::FrameTeam* alone, Anytime* anytime);
void begin_lanes(Lanes& lanes, bool cold, double tick_ns);

using WeighShell = void (*)(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                            Lane& lane);
// Calls `weigh` once for every shell body; the lanes' reports go into `report`.
void run_lanes(Lanes& lanes, const Settings& set, std::span<const Body> bodies,
               std::span<ShellBody> shells, WeighShell weigh, h6FrameReport& report);

}  // namespace h6
