// SPDX-License-Identifier: Apache-2.0
// pair.h - a shell body against a field body, and all pairs of one shell body.
//
// A pair is kept in columns, because stages read different parts of it: what a search remembers,
// what the contacts do to both bodies, and blocks that only moving fields need.
#pragma once
#include <span>

#include "kernels/contact/contact_wrench.h"
#include "kernels/views.h"
#include "runtime/base/math.h"
#include "runtime/contact/body.h"
#include "runtime/contact/contacts.h"

namespace h6 {

// Decides whether a tier of spheres is worth testing. It is not where most spheres survived the
// last test, until there are many more of them or the test has been left out 15 times. The contacts
// are the same either way.
struct CullBypass {
  std::size_t asked = 0;  // how many spheres the last test had
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

// What the search for a pair's contacts remembers from frame to frame: METHOD.md, Sec. 6. Ways and
// expiries are in voxels of the field.
struct alignas(64) PairSearch {
  std::size_t first = 0, candidates = 0;  // this frame's rows among the candidates
  int found_by = 0;                       // the thread whose scratch holds them
  float missed = 0;  // of a coarse traversal: no point that was left out is deeper [voxel]
  // No point of a group can touch before the way has passed the group's expiry. A block's expiry is
  // the least of its groups'.
  float *group_expiry = nullptr, *block_expiry = nullptr;
  // Bit i: the group's point i was near when all of its points were last sampled. No other point of
  // the group can touch before rest_expiry.
  std::uint16_t* near_rows = nullptr;
  float* rest_expiry = nullptr;
  double travelled = -1;                         // the way to the anchor; < 0: nothing is known
  std::size_t sampled = 0;                       // groups in the last traversal
  std::size_t open_blocks = 0, open_groups = 0;  // near ones, when groups were last tested
  CullBypass cull_blocks, cull_groups;
  CullBypass pick_rows;          // single points of groups
  kernels::Affine last_place{};  // of the shell in the field, in the last traversal
  kernels::Affine anchor{};      // a place that the shell has stayed near to since
  kernels::Affine arms{};        // contact arms [m] to voxels, when the contacts were made
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
  std::size_t begin = 0, end = 0;      // rows among the shell body's contacts
  BetweenBodies* between = nullptr;    // where both bodies move
  BetweenFields* of_fields = nullptr;  // `series`, where b moves
  // The wrench on a, and sum w k J J^T (`series`: the pair's share of the net stiffness, as if all
  // fields of the shell body moved alike). Telemetry and passivity read both.
  Vec6 f = Vec6::Zero();
  Mat6 B = Mat6::Zero();
  // Of the passivity controller, in one frame.
  Vec6 u = Vec6::Zero();       // a against b at a's centre of mass, before the step
  Vec3 arm = Vec3::Zero();     // x_a - x_b, before the step
  Vec6 relief = Vec6::Zero();  // what may be taken away from f
};

static_assert(sizeof(Pair) <= 512 && sizeof(PairSearch) <= 320);

// The energy port between one shell body's contacts and the fields: passivity.h.
struct ContactPort {
  double energy = 0;  // [J]
  bool known = false;
  double alpha = 0;  // the controller's damping in this frame, on top of beta [s]
};

// A body whose shell meets fields: its pairs, and the contacts of all of them together.
struct alignas(64) ShellBody {
  std::int32_t body = -1;
  std::span<Pair> pairs;
  std::span<PairSearch> searches;      // (pairs)
  std::span<kernels::WrenchSum> sums;  // (pairs) over this frame's contacts
  Contacts contacts{};
  double series_y[6] = {};  // `series`: the spring's extension in the last frame, a warm start
  ContactPort port;
  double traverse_ns = 0;     // what the last traversal of all pairs took
  bool pairs_shared = false;  // two threads shared it
  double all_ns = 0;          // what traversal, contacts and weights took last
};

}  // namespace h6
