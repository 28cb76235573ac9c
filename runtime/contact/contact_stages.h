// SPDX-License-Identifier: Apache-2.0
// contact_stages.h - the stages that find the contacts of one shell body, weigh them and sum them.
#pragma once
#include "runtime/contact/lane.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"

namespace h6 {

inline constexpr std::size_t kSumSlice = 1024;  // contacts summed at a time; slices added in order

// ---- these may run side by side for several shell bodies: each writes only its own body and lane

// `series`, `firm`: notes how far points may be carried ahead: PairSearch::ahead,
// PairSearch::margin.
void look_ahead(const Settings& set, std::span<const Body> bodies, ShellBody& shell);
// Finds the shell points that touch a field, rows of the last level with a distance below zero, and
// those within the pair's margin that can carry load. If there are too many, every place and
// direction keeps its deepest.
void traverse(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane);
// Fills depth, normal, gradient and arm of each contact.
void gather_contacts(std::span<const Body> bodies, ShellBody& shell, Lane& lane);
// Shares the stiffness among all contacts of the shell body, all fields pooled. METHOD.md, Sec. 3.
void weigh_contacts(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                    Lane& lane);
// The team, if the weighing of so many contacts is faster on all of its threads; else null.
sched::FrameTeam* weighing_team(std::size_t count, Lane& lane);
inline constexpr std::size_t kPushedRows = 512;  // contacts that get their push and e at a time
// `firm`, rows begin..end-1 of a pair with body b, kPushedRows at most: replaces N by the direction
// in which each contact pushes, fills facing, and notes in slack and kappa how much each counts in
// the density and the stiffness of its direction.
void push_firmly(const Settings& set, const Body& b, const Pair& pair, Contacts& c,
                 std::size_t begin, std::size_t end);
void weigh_series(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane);
// Sums each pair's contacts into pair.sum. `series` and `firm`: as sum_series_rows.
void sum_contacts(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane);
// Stretches the friction springs by the motion since the last step, lets them slip, and sums their
// wrenches into pair.friction. It reads the normal loads of all contacts.
void sum_friction(const Settings& set, std::span<const Body> bodies, ShellBody& shell, Lane& lane);

// ---- this runs for one shell body after the other, in order

// Adds the sums to the wrenches on both bodies of each pair, and to the blocks between them.
void add_wrenches(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                  std::span<LinearWrench> acting);

// ---- the parts of add_wrenches, for sums from any source

// A pair's two bodies, and the wrench that acts on each.
struct Sides {
  const Body &a, &b;
  LinearWrench &on_a, &on_b;
};
// A pair without contacts has no wrench and changes none.
void clear_wrench(Pair& pair);
inline Sides sides_of(const Pair& pair, std::span<const Body> bodies,
                      std::span<LinearWrench> acting) {
  return {bodies[pair.a], bodies[pair.b], acting[pair.a], acting[pair.b]};
}
void spread_wrench(const Settings& set, const Sides& sides, Pair& pair,
                   const kernels::WrenchSum& sum);
// `series`: call spread_series for each pair with contacts, then join_series once for the shell
// body. The latter reads pair.sum.
void spread_series(const Settings& set, const Sides& sides, Pair& pair,
                   const kernels::WrenchSum& sum);
void join_series(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                 std::span<LinearWrench> acting);
// Adds a pair's friction to the wrenches on both bodies, and to the blocks between them.
void add_friction(const Settings& set, const Sides& sides, Pair& pair,
                  const FrictionSpring& spring);
// Adds to the derivatives how an elastic wrench f on a changes as its arms and normals turn.
void add_geometric_terms(const Sides& sides, Pair& pair, const Vec6& f);

// S = [I 0; [x_a - x_b]x I]: carries a wrench about a's centre of mass to b's.
Mat6 arm_shift(const Body& a, const Body& b);
// The velocity of a against b at a's centre of mass: u_a - S^T u_b.
Vec6 pair_velocity(const Body& a, const Body& b);

}  // namespace h6
