// SPDX-License-Identifier: Apache-2.0
// pair.h - a shell body against a field body, and all pairs of one shell body.
//
// A pair is split over several structs, because stages read different parts of it: the memory of a
// search, the wrenches on both bodies, and blocks that only moving fields need. A session has rows
// of pairs for those that are near: frame/near_pairs.h.
#pragma once
#include <span>

#include "kernels/contact/contact_wrench.h"
#include "kernels/views.h"
#include "runtime/base/math.h"
#include "runtime/contact/body.h"
#include "runtime/contact/contacts.h"
#include "runtime/contact/fit.h"
#include "runtime/contact/friction.h"
#include "runtime/contact/quiet.h"

namespace h6 {

// Decides whether a tier of spheres is worth testing. If more than 7 of 8 spheres survived the last
// test, the next 15 tests are left out, unless the number of spheres grows much. The contacts are
// the same either way.
struct CullBypass {
  std::size_t asked = 0;  // how many spheres the last test examined
  int left_out = 0;       // how many tests are still to be left out

  bool worth(std::size_t count) {
    if (left_out == 0 || count > 2 * asked + 64) return true;
    --left_out;
    return false;
  }
  void learn(std::size_t count, std::size_t kept) {
    asked = count;
    left_out = 8 * kept > 7 * count ? 15 : 0;
  }
};

// One row for each group or block of a shell: what a search remembers of a pair. Distances
// travelled are in voxels of the field.
struct SearchColumns {
  float* block_way = nullptr;  // no point of a block travelled farther, up to the anchor
  // No point of a group can touch before its block's way exceeds the group's expiry. A block's
  // expiry is the least of its groups' expiries.
  float *group_expiry = nullptr, *block_expiry = nullptr;
  // Bit i: the group's point i was near when all of its points were last sampled. No other point of
  // the group can touch before rest_expiry.
  std::uint16_t* near_rows = nullptr;
  float* rest_expiry = nullptr;
};

// The memory of the search for a pair's contacts, from frame to frame: METHOD.md, Sec. 6. Without
// columns of its own a pair borrows those of a lane, and remembers nothing.
struct alignas(64) PairSearch : SearchColumns {
  std::size_t first = 0, candidates = 0;  // this frame's rows among the candidates
  std::size_t number = 0;                 // place among all pairs that are near
  unsigned found_by = 0;                  // the thread whose scratch holds them
  float missed = 0;  // after a coarse traversal: no point that was left out is deeper [voxel]
  // `series`, `firm`: the common spring and damping may carry points towards the field by this
  // screw (v [m], w) about a's centre of mass, world frame; none comes farther than margin [voxel].
  float ahead[6] = {}, margin = 0;
  double travelled = -1;    // no way is longer but for rounding; < 0: nothing is known
  std::size_t sampled = 0;  // groups that the last traversal sampled
  std::size_t open_blocks = 0, open_groups = 0;  // how many were near when last tested
  CullBypass cull_blocks, cull_groups;
  CullBypass pick_rows;          // decides whether to test single points of groups
  std::uint32_t touched = 0;     // a block that touched in the last traversal that found any
  kernels::Affine last_place{};  // from the shell to the field, in the last traversal
  kernels::Affine anchor{};      // a place that the shell has stayed near to since
  PairFit fit;
  Quiet quiet;
  kernels::Affine arms{};  // maps contact arms [m] to voxels, as the contacts were made
};

// A pair whose bodies both move: how the motion of one changes the wrench on the other.
struct BetweenBodies {
  Mat6 Kab = Mat6::Zero(), Kba = Mat6::Zero(), Dab = Mat6::Zero(), Dba = Mat6::Zero();
};

// `series` couples the field bodies of one shell body: pair p's wrench on b_p changes by
// left_p right_q with the motion of b_q, and by beta left_p right_d_q with its velocity.
struct BetweenFields {
  Mat6 left = Mat6::Zero(), right = Mat6::Zero(), right_d = Mat6::Zero();
};

// Shell body a against field body b.
struct alignas(64) Pair {
  std::int32_t a = -1, b = -1;
  bool awake = false;                  // it was traversed in the last step
  bool touches = false;                // and found a point inside
  std::size_t begin = 0, end = 0;      // rows among the shell body's contacts
  BetweenBodies* between = nullptr;    // where both bodies move
  BetweenFields* of_fields = nullptr;  // `series`, where b moves
  FrictionSpring* friction = nullptr;  // null without friction
  // The wrench on a, and B = sum w k J J^T (`series`: the pair's share of the net stiffness if all
  // fields of the shell body moved alike). Telemetry and passivity read both.
  Vec6 f = Vec6::Zero();
  Mat6 B = Mat6::Zero();
  // The passivity controller uses these within one frame.
  Vec6 u = Vec6::Zero();       // velocity of a against b at a's centre of mass, before the step
  Vec3 arm = Vec3::Zero();     // x_a - x_b, before the step
  Vec6 relief = Vec6::Zero();  // what may be taken away from f
  PairSearch search;
  kernels::WrenchSum sum;  // over this frame's contacts
};

// Pairs that lie anywhere, in their order.
class PairList {
 public:
  PairList() = default;
  explicit PairList(std::span<Pair* const> pairs) : pairs_(pairs) {}
  struct Iterator {
    Pair* const* at;
    Pair& operator*() const { return **at; }
    Iterator& operator++() { return ++at, *this; }
    bool operator!=(const Iterator& other) const { return at != other.at; }
  };
  Iterator begin() const { return {pairs_.data()}; }
  Iterator end() const { return {pairs_.data() + pairs_.size()}; }
  std::size_t size() const { return pairs_.size(); }
  bool empty() const { return pairs_.empty(); }
  Pair& operator[](std::size_t i) const { return *pairs_[i]; }
  PairList first(std::size_t count) const { return PairList(pairs_.first(count)); }
  PairList last(std::size_t count) const { return PairList(pairs_.last(count)); }

 private:
  std::span<Pair* const> pairs_;
};

// The energy port between one shell body's contacts and the fields: passivity.h.
struct ContactPort {
  double energy = 0;  // [J]
  bool known = false;
  double alpha = 0;  // the controller's damping in this frame, on top of beta [s]
};

// A body whose shell may meet fields, with its pairs and the contacts of all of them.
struct alignas(64) ShellBody {
  std::int32_t body = -1;
  PairList pairs;                   // those that are awake in this step
  std::span<SearchColumns> unused;  // for pairs that come near
  std::size_t unused_count = 0;
  Contacts contacts{};
  double series_y[6] = {};  // `series`: the spring's last extension, from which the solver starts
  ContactPort port;
};

}  // namespace h6
