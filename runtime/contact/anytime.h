// SPDX-License-Identifier: Apache-2.0
// anytime.h - decides what a traversal leaves out so that the frame ends in time.
//
//   elapsed + groups to sample + contacts to weigh + the rest  <=  budget
//
// Tier t samples 2^t points of each group of sixteen. A frame takes the finest tier that keeps the
// budget. If the machine delays a frame that already samples one point, the frame keeps only the
// few deepest contacts. Costs are learnt from earlier frames, as values that few frames exceed. The
// cost of one contact grows with the number of contacts, at most in proportion. So the next coarser
// tier bounds the cost of a tier that has not run lately, and trying a tier makes no frame late.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "hapsix/hapsix.h"
#include "runtime/contact/pair.h"
#include "sched/clock.h"

namespace h6 {

struct Anytime {
  static constexpr std::uint32_t kByClock = UINT32_MAX;
  static constexpr int kAll = 4;           // the tier that samples all points
  static constexpr std::size_t kFew = 64;  // contacts that a shell body keeps when `few`
  static constexpr int kSizes = 32;        // classes of frames: class i has 2^i contacts or more
  PairList pairs;                          // those that are traversed in this step, in order
  std::size_t near = 0;             // how many pairs are near: PairSearch::number counts them
  double budget_ns = 0;             // from the start of a step; 0: none
  double period_ns = 1e6;           // from one step to the next
  bool no_clock = false;            // virtual time: frames have no deadline
  std::uint32_t forced = kByClock;  // coarse pairs of the next step, whatever the clock says
  std::uint32_t forced_points = 1;  // points sampled of each sixteen in those pairs
  std::int64_t (*clock)() = sched::now_ns;  // tests replace it
  // The state of this frame.
  std::int64_t start = 0;
  double steps = 1;       // of the frame
  bool by_clock = false;  // the clock decides
  bool coarse = false;    // the clock has decided that this pair and all later ones are coarse
  std::uint32_t coarse_pairs = 0;  // how many of the last `pairs` are coarse
  int tier = 0;                    // the tier of the coarse pairs
  bool few = false;                // coarse pairs keep kFew contacts per shell body
  int fitting = kAll;              // the finest tier that would have fitted with some time to spare
  // Costs learnt from earlier frames. They start with those of a slow machine.
  double group_ns = 60;           // the time to sample sixteen points
  double contacts_per_group = 4;  // contacts found per sampled group
  double rest_ns = 3000;          // the time of coupling, step and output
  // Cost of making, weighing and summing one contact, in frames of about `contacts` contacts.
  struct Cost {
    double contacts = 0, ns = 0;
    double seen[3] = {};  // newest first
    std::uint32_t times = 0;
    std::uint64_t when = 0;  // the number of the last frame of that size
  } contact[kSizes];
  std::uint64_t frames = 0;
  bool begun = false;                   // a tier was chosen at least once
  int finest = kAll;                    // the finest tier that is allowed
  std::uint32_t calm = 0, strikes = 0;  // frames in a row that would allow a finer or coarser tier
};

// `steps` of the frame share its budget.
void begin_anytime(Anytime& a, std::int64_t start, std::uint32_t steps = 1);
// Says which pairs a step traverses, of `near` that are near. `first`: it is the frame's first
// step.
void begin_traversal(Anytime& a, PairList pairs, std::size_t near, bool first);
// Call it after the first of several steps. The others leave out the same pairs and points, so that
// one pair of numbers repeats the frame. Nothing is learnt from such a frame.
void decide_no_more(Anytime& a);
// Both decide whether the pair is traversed coarsely, in a.tier. After the first coarse pair all
// later ones of the frame are coarse. `pair` is one of a.pairs, `used` contacts were found before
// it, and `blocks` of its own are open. is_coarse_anyway is called before the pair's groups are
// tested, must_be_coarse when `groups` of them are known to be near. Coarse pairs are counted among
// all that are near, because only those follow from the poses alone.
bool is_coarse_anyway(Anytime& a, const PairSearch& pair, std::size_t used, std::size_t blocks);
bool must_be_coarse(Anytime& a, PairSearch& pair, std::size_t used, std::size_t blocks,
                    std::size_t groups);
// Returns true when there is no time for `found` contacts. It has then made a.tier coarser, and the
// caller traverses the pair again.
bool must_be_coarser(Anytime& a, const PairSearch& pair, std::size_t used, std::size_t found,
                     std::size_t blocks);
// The shell body whose first pair is `first` has `found` candidates, more than kFew of them in
// coarse pairs. Returns whether it must keep only kFew of these.
bool must_be_few(Anytime& a, const PairSearch& first, std::size_t found);
// How many of `pairs`, a part of a.pairs, are coarse. The coarse ones are the last.
std::size_t coarse_pairs_of(const Anytime& a, PairList pairs);
// Learns from a pair that began at `since`, sampled `groups` of its `near` groups (sixteen points
// each) and found `found` contacts.
void learn_sampling(Anytime& a, std::size_t groups, std::size_t near, std::size_t found,
                    std::int64_t since);
// Learns from the times of the frame's stages. Call it at the end of the frame.
void learn_frame(Anytime& a, const h6FrameReport& report);
// Writes to the report what the frame left out.
void report_anytime(const Anytime& a, h6FrameReport& report);

}  // namespace h6
