// SPDX-License-Identifier: Apache-2.0
// anytime.h - decides what a traversal leaves out so that the frame ends in time.
//
//   elapsed + groups to sample + contacts to weigh + the rest  <=  budget
//
// Tier t samples 2^t points of each group of sixteen; the finest tier that keeps the budget is
// taken. Where the machine held up a frame that samples one point already, only the few deepest
// contacts are kept. Costs are learnt from earlier frames, as values that few frames exceed. The
// cost of one contact grows with the number of contacts, at most in proportion. So the next coarser
// tier bounds the cost of a tier that has not run lately, and no frame is late because a tier was
// tried.
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
  static constexpr int kAll = 4;           // the tier of all points
  static constexpr std::size_t kFew = 64;  // contacts of a shell body
  static constexpr int kSizes = 32;        // of frames: 2^i contacts and more
  std::span<const PairSearch> pairs;       // all of the session, in the order of traversal
  double budget_ns = 0;                    // from the start of a step; 0: none
  double period_ns = 1e6;                  // from one step to the next
  bool no_clock = false;                   // virtual time: frames have no deadline
  std::uint32_t forced = kByClock;         // coarse pairs of the next step, whatever the clock says
  std::uint32_t forced_points = 1;         // of sixteen, in those pairs
  std::int64_t (*clock)() = sched::now_ns;  // tests have their own
  // Of this frame.
  std::int64_t start = 0;
  bool by_clock = false;  // the clock decides
  bool coarse = false;    // the clock has decided: this pair and all that follow are coarse
  std::uint32_t coarse_pairs = 0;  // the last so many of `pairs`
  int tier = 0;                    // of the coarse pairs
  bool few = false;                // coarse pairs keep kFew contacts a shell body
  int fitting = kAll;              // the finest tier that would have fitted with some time to spare
  // Learnt. Before anything is known: what a slow machine takes.
  double group_ns = 60;           // to sample sixteen points
  double contacts_per_group = 4;  // of the groups that are sampled
  double rest_ns = 3000;          // coupling, step, output
  // Cost of making, weighing and summing one contact, in frames of about `contacts` contacts.
  struct Cost {
    double contacts = 0, ns = 0;
    double seen[3] = {};  // newest first
    std::uint32_t times = 0;
    std::uint64_t when = 0;  // the last frame of that size
  } contact[kSizes];
  std::uint64_t frames = 0;
  bool begun = false;                   // a tier was chosen at least once
  int finest = kAll;                    // the finest tier that is allowed
  std::uint32_t calm = 0, strikes = 0;  // frames in a row that would allow a finer or coarser tier
};

void begin_anytime(Anytime& a, std::int64_t start);
// Is the pair traversed coarsely, in a.tier? Once one is, all that follow in the frame are. `pair`
// is one of a.pairs, `used` contacts were found before it, `blocks` of its own are open. The first
// is called before the pair's groups are tested, the second when `groups` of them are known to be
// near.
bool is_coarse_anyway(Anytime& a, const PairSearch& pair, std::size_t used, std::size_t blocks);
bool must_be_coarse(Anytime& a, PairSearch& pair, std::size_t used, std::size_t blocks,
                    std::size_t groups);
// Are `found` contacts more than there is time for? Then a.tier is coarser now: traverse again.
bool must_be_coarser(Anytime& a, const PairSearch& pair, std::size_t used, std::size_t found,
                     std::size_t blocks);
// A shell body whose first pair is `first` has `found` candidates, more than kFew of them in coarse
// pairs. Is it to keep kFew of them?
bool must_be_few(Anytime& a, const PairSearch& first, std::size_t found);
// The coarse ones of `pairs`, some of a.pairs: the last so many.
std::size_t coarse_pairs_of(const Anytime& a, std::span<const PairSearch> pairs);
// A pair sampled `groups` (sixteen points each), of `near` in all, since `since`, and found so many
// contacts.
void learn_sampling(Anytime& a, std::size_t groups, std::size_t near, std::size_t found,
                    std::int64_t since);
// Learns from the frame's stages, at its end.
void learn_frame(Anytime& a, const h6FrameReport& report);
// Tells the report what was left out.
void report_anytime(const Anytime& a, h6FrameReport& report);

}  // namespace h6
