// SPDX-License-Identifier: Apache-2.0
// anytime.h - what of a frame's traversal to leave out so that the frame ends in time.
//
//   elapsed + groups to sample + contacts to weigh + the rest  <=  budget
//
// Of each group of sixteen points one, two, four, eight or all are looked at: the finest tier that
// keeps this. Where the machine held up a frame that looked at one already, the few deepest
// contacts are all that is left of it. Costs are learnt from the frames before, as what few of them
// exceed. A contact costs more the more there are, at most in proportion; so what a tier costs that
// was not seen lately is bounded by what the next coarser one does, and no frame is late for having
// been tried.
#pragma once
#include <cstddef>
#include <cstdint>

#include "sched/clock.h"

struct h6Session;

namespace h6 {

struct Anytime {
  static constexpr std::uint32_t kByClock = UINT32_MAX;
  static constexpr int kAll = 4;           // tier t looks at 2^t points of sixteen
  static constexpr std::size_t kFew = 64;  // contacts of a shell body
  static constexpr int kSizes = 32;        // of frames: 2^i contacts and more
  double budget_ns = 0;                    // from the start of a step; 0: none
  bool no_clock = false;                   // virtual time: frames have no deadline
  std::uint32_t forced = kByClock;         // coarse pairs of the next step, whatever the clock says
  std::uint32_t forced_points = 1;         // of sixteen, in those
  std::int64_t (*clock)() = sched::now_ns;  // tests have their own
  // Of this frame.
  std::int64_t start = 0;
  bool by_clock = false, coarse = false;
  bool few = false;    // its coarse pairs have kFew contacts a shell body
  int tier = 0;        // of its coarse pairs
  int fitting = kAll;  // the finest that would have fitted with something to spare
  // Learnt. Where nothing is known yet, what a slow machine takes.
  double group_ns = 60;           // to sample sixteen points
  double contacts_per_group = 4;  // of those that are sampled
  double rest_ns = 3000;          // coupling, step, output
  // To make a contact, weigh it and sum it up, in frames of one size.
  struct Cost {
    double contacts = 0, ns = 0;  // so many, each
    double seen[3] = {};          // newest first
    std::uint32_t times = 0;
    std::uint64_t when = 0;  // frame that was last of that size
  } contact[kSizes];
  std::uint64_t frames = 0;
  bool begun = false;                   // something was decided
  int finest = kAll;                    // tier that is allowed
  std::uint32_t calm = 0, strikes = 0;  // frames in a row that would allow more, or less
};

void begin_anytime(h6Session& s, std::int64_t start);
// Is pair `pair` to be traversed coarsely, in anytime.tier? `used` contacts were found before it,
// `blocks` of its own are open. Once it is so, it stays so for the frame. The first is asked before
// its groups are looked at, the second when `groups` of them are known to be near.
bool is_coarse_anyway(h6Session& s, std::size_t pair, std::size_t used, std::size_t blocks);
bool must_be_coarse(h6Session& s, std::size_t pair, std::size_t used, std::size_t blocks,
                    std::size_t groups);
// `found` contacts are more than there is time for: anytime.tier is coarser now, do it again.
bool must_be_coarser(h6Session& s, std::size_t pair, std::size_t used, std::size_t found,
                     std::size_t blocks);
// A shell body whose first pair is `first` has `found` candidates, more than kFew of them in coarse
// pairs. Are these to become kFew?
bool must_be_few(h6Session& s, std::size_t first, std::size_t found);
// What a pair took to sample `groups` (sixteen points each), of `near` in all, and what the frame
// did.
void learn_sampling(h6Session& s, std::size_t groups, std::size_t near, std::size_t found,
                    std::int64_t since);
void learn_frame(h6Session& s);

}  // namespace h6
