// SPDX-License-Identifier: Apache-2.0
// shell_lanes.h - shares the shell bodies of a frame out: either all threads weigh one after the
// other, or each thread weighs its own.
//
// Many hands hold many parts. Traversal, contacts and weights of one shell body need nothing of
// another, so shell bodies can be weighed side by side. Each thread has a lane with its own scratch
// and report. Wrenches are added afterwards, in order, so the bits are those of one thread.
#pragma once
#include "runtime/contact/lane.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"

namespace h6 {

struct Lanes {
  std::span<Scratch> scratch;  // one for each thread that may use one
  Lane whole;                  // all threads share the slices and pairs of one shell body
  std::span<Lane> single;      // (threads) one thread each; none: only one body, or one thread
  ShareGate bodies;            // whether the single lanes are faster
};

// lanes.scratch and lanes.single must be laid out. `alone` is a team of one thread.
void open_lanes(Lanes& lanes, sched::FrameTeam* team, sched::FrameTeam* alone, Anytime* anytime);
// From now on the one thread of these lanes uses this scratch.
void borrow(Lanes& lanes, Scratch& scratch);
void begin_lanes(Lanes& lanes, bool cold, double tick_ns);

using WeighShell = void (*)(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                            Lane& lane);
// Calls `weigh` once for every shell body given; the lanes' reports go into `report`.
void run_lanes(Lanes& lanes, const Settings& set, std::span<const Body> bodies,
               std::span<ShellBody* const> shells, WeighShell weigh, h6FrameReport& report);

}  // namespace h6
