// anytime.h - what of a frame's traversal to leave out so that the frame ends in time.
//
//   elapsed + groups to sample + contacts to weigh + the rest  >  budget:  one point in sixteen
//
// Costs are learnt from the frames before: quickly when they rise, slowly when they fall.
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
  // Learnt. Where nothing is known yet, what a slow machine takes.
  double group_ns = 60;           // to sample a group of points
  double contacts_per_group = 4;  // of those that are sampled
  double contact_ns = 60;         // to make a contact, weigh it and sum it up
  double rest_ns = 3000;          // coupling, step, output
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
