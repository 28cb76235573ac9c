// SPDX-License-Identifier: Apache-2.0
// near_pairs.h - which pairs of bodies are near, and which of these must be traversed.
//
//   all that may touch  ->  near: the boxes of both overlap, with some slack; they have a row
//                       ->  awake: the boxes overlap without it, and the pair is not quiet
//
// The list of near pairs changes only when a body leaves its box with slack. A near pair that
// sleeps costs a comparison, any other nothing. The list follows from the poses alone, so recorded
// runs repeat; quiet.h has what is quiet. METHOD.md, Sec. 6.
#pragma once
#include <cstdint>
#include <span>

#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"
#include "runtime/frame/body_boxes.h"
#include "sched/host_memory.h"

struct h6Session;

namespace h6 {

// Where a body is, for the search of near pairs.
struct BodyPlace {
  Box shell, field;       // around its points; around all places where one can touch. World [m]
  Vec3 x = Vec3::Zero();  // the pose that they belong to
  Quat q = Quat(0, 0, 0, 0);
  double radius = 0;  // of both boxes about the centre of mass [m]
  double reach = 0;   // the points of both move no farther in the coming step [m]
  bool left = false;  // it has left its box with slack
};

struct NearPairs {
  struct Listed {
    std::int32_t a, b;
    std::uint32_t rank;  // in the order of traversal
  };
  struct Near {
    std::uint64_t key;   // the order of traversal: by shell body, then by rank or by field body
    std::uint32_t slot;  // row of `pairs`
  };
  std::span<Listed> listed;  // by a, b; empty: every moving shell may touch every other field
  std::span<std::int32_t> listed_field;  // (listed) in the order of traversal
  std::span<Pair> pairs;                 // (capacity)
  std::span<std::uint32_t> unused;       // (capacity) rows of `pairs`
  std::span<Near> near, spare;           // (capacity) the near pairs, ascending; room to merge
  std::span<std::uint64_t> found;        // (kFound times the capacity) keys
  std::span<Pair*> awake;                // (capacity) in the order of traversal
  std::span<ShellBody*> active;          // (shells) those with pairs that are awake
  std::span<BodyPlace> places;           // (bodies)
  std::span<std::uint32_t> lively;       // (bodies) not fixed, or moved by the program; ascending
  BodyBoxes boxes;                       // with slack
  std::size_t near_count = 0, unused_count = 0, awake_count = 0, active_count = 0, lively_count = 0;
  bool left_out = false;    // there was no room for some pair
  bool everything = false;  // keep_all_awake was called
  static constexpr std::size_t kFound = 4;

  std::span<const Near> all_near() const { return near.first(near_count); }
  std::span<const std::uint32_t> all_lively() const { return lively.first(lively_count); }
  std::span<ShellBody* const> all_active() const { return active.first(active_count); }
  PairList all_awake() const { return PairList(awake.first(awake_count)); }
};

// The listed pairs in the order of traversal: those of one shell body are neighbours.
sched::HostVector<h6PairDef> sorted_pairs(const h6SessionDef& def);

// Calls f(shell body, field body) for every pair of a definition, in the order of traversal.
// `sorted`: its sorted_pairs. If none are listed: every moving shell against every other field. Two
// moving bodies that both have a shell and a field make one pair, not two.
//
// A shell that bends counts as one that moves.
template <class F>
void each_pair(const h6Model& model, const h6SessionDef& def, std::span<const h6PairDef> sorted,
               F&& f) {
  for (const h6PairDef& p : sorted) f(p.shell_body, p.field_body);
  if (!sorted.empty()) return;
  const auto count = static_cast<std::int32_t>(def.body_count);
  for (std::int32_t a = 0; a < count; ++a) {
    const h6BodyDef& shell = def.bodies[a];
    if (shell.shell < 0 || (shell.fixed && !model.shells[shell.shell].bends())) continue;
    for (std::int32_t b = 0; b < count; ++b) {
      const h6BodyDef& field = def.bodies[b];
      const bool both = !field.fixed && field.shell >= 0 && shell.field >= 0;
      if (a != b && field.field >= 0 && !(both && b < a)) f(a, b);
    }
  }
}

// Takes all places and boxes anew and finds the pairs that are near. Bodies and pairs must be set;
// pairs that were near before are forgotten.
void open_near_pairs(h6Session& s);
// Follows the bodies that may move, and updates the list of near pairs for motions of up to
// BodyPlace::reach. Does not allocate.
void find_near_pairs(h6Session& s);
// Fills ShellBody::pairs with the pairs that must be traversed at the present poses.
void wake_pairs(h6Session& s);
// The body may move from now on, even if it is fixed. Returns whether that is new.
bool make_lively(NearPairs& n, std::size_t body);

// For tests: from now on every pair is near and awake in every step.
void keep_all_awake(h6Session& s);

bool may_touch(const h6Session& s, std::int32_t a, std::int32_t b);
// Null: the pair is not near.
Pair* find_near_pair(const h6Session& s, std::int32_t a, std::int32_t b);

}  // namespace h6
