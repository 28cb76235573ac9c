// SPDX-License-Identifier: Apache-2.0
// lane.h - what a worker needs to weigh one shell body's contacts: scratch, threads, a report.
#pragma once
#include <span>

#include "hapsix/hapsix.h"
#include "kernels/contact/contact_wrench.h"
#include "runtime/contact/anytime.h"
#include "runtime/contact/friction.h"
#include "runtime/contact/share_gate.h"
#include "runtime/contact/weighing.h"
#include "sched/clock.h"
#include "sched/frame_team.h"

namespace h6 {

// Lists and candidates of one traversal, sized for the largest shell.
struct TraverseScratch {
  std::uint32_t *frontier = nullptr, *survivors = nullptr;  // (groups)
  std::uint32_t *far = nullptr, *far_survivors = nullptr;   // (groups)
  std::uint32_t* open_blocks = nullptr;                     // (blocks)
  float *way_now = nullptr, *way_from = nullptr;            // (blocks) [voxel]
  float* clearance = nullptr;                               // (groups) [voxel]
  std::uint16_t *rows = nullptr, *near_rows = nullptr;      // (groups)
  float* rest = nullptr;                                    // (groups) [voxel]
  float* reach = nullptr;                                   // (groups) of the shell [voxel]
  std::uint32_t* candidate = nullptr;                       // (capacity) rows of the shell
  float* candidate_distance = nullptr;                      // (capacity) [voxel]
  float* key = nullptr;                                     // (capacity) decides which to drop
  float *gradient_x = nullptr, *gradient_y = nullptr, *gradient_z = nullptr;  // (capacity)
  std::size_t used = 0, capacity = 0;                                         // candidates
  kernels::Touching apart{};  // (points) candidates before slices are joined, or null
  SearchColumns lent;         // for pairs without columns
};

struct Scratch {
  TraverseScratch traverse;
  ClusterScratch cluster{};
  char* weigh = nullptr;                    // weigh_scratch_bytes(max_contacts) bytes, or null
  std::size_t* slice_count = nullptr;       // (slices of groups) how many points touch
  kernels::WrenchSum* slice_sum = nullptr;  // (slices of contacts)
  FrictionScratch friction;
};

struct Lane {
  Scratch* scratch = nullptr;
  std::span<Scratch> scratches;  // one for each thread of the team; none: pairs are not shared
  sched::FrameTeam* team = nullptr;
  // Whether the team shares the pairs, the groups of one pair, the making of contacts, their
  // directions of push and e, their weighing, their summing and their friction.
  ShareGate pairing, touching, making, pushing, weighing, summing, rubbing;
  Anytime* anytime = nullptr;  // one for the frame; lanes that run side by side only read it
  bool cold = false;           // other programs have used the caches since the last frame
  double tick_ns = 1;          // the length of one tick of sched::ticks
  h6FrameReport report{};      // covers this lane alone
};

// Calls run(i) for every slice, on the team's threads where the gate says that this is faster.
// `items`: how much work it is, in any unit.
template <class F>
void share_slices(Lane& lane, ShareGate& gate, std::size_t items, std::size_t slices, F&& run) {
  const bool may = slices > 1 && lane.team->threads() > 1;
  const std::int64_t since = may ? sched::now_ns() : 0;
  if (may && gate.share(items)) {
    lane.team->for_slices(slices, run);
  } else {
    for (std::size_t i = 0; i < slices; ++i) run(i);
  }
  if (may) gate.took(static_cast<double>(sched::now_ns() - since));
}

}  // namespace h6
