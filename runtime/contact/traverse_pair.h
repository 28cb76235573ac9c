// SPDX-License-Identifier: Apache-2.0
// traverse_pair.h - finds the points of one shell that touch one field.
#pragma once
#include "kernels/contact/touch_groups.h"
#include "runtime/contact/lane.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"

namespace h6 {

inline constexpr std::size_t kTouchSlice = 32;  // groups sampled at a time: some 2 us
// Groups from which the helper takes slices: some 6 us of work.
inline constexpr std::size_t kWorthSharing = 80;

// Puts the candidates of shell body a against field body b behind `used` in the scratch, and
// returns how many there are. Two tiers of spheres are tested, then points; of each only those that
// may have come within reach since they were last tested. Where time is short the traversal ends
// with the finest tier that is complete; what it leaves out stays expired. `shared`: the pair is
// itself a slice, so the other thread has work of its own.
std::size_t traverse_pair(const Settings& set, const Body& a, const Body& b, PairSearch& pair,
                          TraverseScratch& t, Lane& lane, std::size_t used, bool shared);

kernels::Touching candidates_from(const TraverseScratch& t, std::size_t at);
// From one scratch to another, or within one; the two ranges may overlap.
void move_candidates(const TraverseScratch& to, std::size_t to_row, const TraverseScratch& from,
                     std::size_t from_row, std::size_t count);

}  // namespace h6
