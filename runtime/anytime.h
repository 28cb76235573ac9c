// anytime.h - what of a frame's traversal to leave out so that the frame ends in time.
//
//   elapsed + groups to sample + contacts to weigh + the rest  >  budget:  one point in sixteen
//
// Costs are learnt from the frames before. What a full frame costs is only seen in one, and to try
// one means to be late where it does not fit. So it is tried where the last ones fitted into the
// period, if not into the budget, or coarse frames say that the machine has become faster; else
// once in half a minute, and half as often each time that it was in vain.
#pragma once
#include <cstddef>
#include <cstdint>

struct h6Session;

namespace h6 {

struct Anytime {
  static constexpr std::uint32_t kByClock = UINT32_MAX;
  double budget_ns = 0;             // from the start of a step; 0: none
  bool no_clock = false;            // virtual time: frames have no deadline
  std::uint32_t forced = kByClock;  // coarse pairs of the next step, whatever the clock says
  // Of this frame.
  std::int64_t start = 0;
  bool by_clock = false, coarse = false;
  bool trying = false;  // it seems not to fit, and is not coarse all the same
  double full_ns = 0;   // what a full one would take
  // Learnt. Where nothing is known yet, what a slow machine takes.
  double group_ns = 60;           // to sample a group of points
  double contacts_per_group = 4;  // of those that are sampled
  double contact_ns = 200;        // to make a contact, weigh it and sum it up, in a full frame
  double rest_ns = 3000;          // coupling, step, output
  // Contacts of a coarse frame are fewer, and cheaper each.
  double coarse_contact_ns = 0;  // 0: none seen
  double coarse_then = 0;        // what that was when a full frame was seen last
  double seen[3] = {};           // contact_ns of the last full frames, newest first
  std::uint32_t full_frames = 0;
  double doubt = 1;  // while frames are coarse: so much of the estimate is believed
  std::uint64_t coarse_frames = 0, next_try = 0;  // in a row; when to try one all the same
  std::uint32_t in_vain = 0;                      // tries
};

void begin_anytime(h6Session& s, std::int64_t start);
// Is pair `pair` to be traversed coarsely? `used` contacts were found before it, `groups` of its
// own are yet to be sampled (0: not known yet). Once it is so, it stays so for the frame.
bool must_be_coarse(h6Session& s, std::size_t pair, std::size_t used, std::size_t groups);
// What a pair took, and what the frame did.
void learn_sampling(h6Session& s, std::size_t groups, std::size_t found, std::int64_t since);
// The same of a pair that was traversed coarsely, `groups` of which were to be sampled.
void learn_coarsely(h6Session& s, std::size_t groups, std::size_t found);
void learn_frame(h6Session& s);

}  // namespace h6
