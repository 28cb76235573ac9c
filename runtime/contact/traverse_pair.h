// SPDX-License-Identifier: Apache-2.0
// traverse_pair.h - finds the points of one shell that touch one field.
#pragma once
#include "kernels/contact/touch_groups.h"
#include "runtime/contact/lane.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"

namespace h6 {

inline constexpr std::size_t kTouchSlice = 32;  // groups sampled at a time, in about 2 us

// Writes the candidates of shell body a against field body b behind row `used` of the scratch, and
// returns how many there are. It tests two tiers of spheres, then points. In each tier it tests
// only those that may have come within reach since their last test. If time is short, the traversal
// ends with the finest complete tier, and all that it leaves out stays expired. Distances have the
// points' relief in them. `shared`: the threads share whole pairs, so the other thread takes no
// slices of this one.
std::size_t traverse_pair(const Settings& set, const Body& a, const Body& b, PairSearch& pair,
                          TraverseScratch& t, Lane& lane, std::size_t used, bool shared);

// The way that no point of shell body a can touch field body b [voxel], from the spheres of blocks;
// where that is under `enough`, from the spheres of groups. Where it is no more than `little`, any
// number up to `little` may be returned. It follows from the poses alone: what the traversal
// remembers can depend on threads and on the clock. `hint`: the block to look at first; any number
// will do.
double clearance(const Settings& set, const Body& a, const Body& b, double enough, double little,
                 std::uint32_t hint, TraverseScratch& t);

kernels::Touching candidates_from(const TraverseScratch& t, std::size_t at);
// Copies candidates from one scratch to another, or within one. The two ranges may overlap.
void move_candidates(const TraverseScratch& to, std::size_t to_row, const TraverseScratch& from,
                     std::size_t from_row, std::size_t count);

}  // namespace h6
