// SPDX-License-Identifier: Apache-2.0
// traverse_pair.h - the points of one shell that touch one field; find_contacts.cpp makes contacts
// of them.
#pragma once
#include "kernels/contact/touch_groups.h"
#include "runtime/frame/session.h"

namespace h6 {

inline constexpr std::size_t kWorthSharing =
    80;  // groups from which the helper is asked: some 6 us

// Candidates of one pair go behind `used`; returns how many there are. Two tiers of spheres, then
// points; of each only what may have come within reach since it was last looked at. Where time is
// short it ends with the deepest tier that is complete: what was not looked at stays expired.
// `alone`: the other thread has work of its own.
std::size_t traverse_pair(h6Session& s, TraverseScratch& t, Pair& pair, std::size_t used,
                          bool alone);

kernels::Touching candidates_from(const TraverseScratch& t, std::size_t at);
// From one's scratch to another's, or within one; the two may overlap.
void move_candidates(const TraverseScratch& to, std::size_t to_row, const TraverseScratch& from,
                     std::size_t from_row, std::size_t count);

}  // namespace h6
