// SPDX-License-Identifier: Apache-2.0
// session.h - everything that changes from frame to frame, in storage sized once.
#pragma once
#include "hapsix/hapsix.h"
#include "kernels/contact/contact_wrench.h"
#include "runtime/base/arena.h"
#include "runtime/base/math.h"
#include "runtime/frame/anytime.h"
#include "runtime/frame/contacts.h"
#include "runtime/frame/passivity.h"
#include "runtime/frame/share_gate.h"
#include "runtime/frame/shell_lanes.h"
#include "runtime/frame/solve.h"
#include "runtime/hand/hand_filter.h"
#include "runtime/hand/safety.h"
#include "runtime/model/model.h"
#include "sched/clock.h"
#include "sched/frame_team.h"

namespace h6 {

// The state of a body is that of its centre of mass; poses outside are those of the mesh frame.
struct RigidState {
  Vec3 x = Vec3::Zero(), v = Vec3::Zero(), w = Vec3::Zero();  // world frame
  Quat q = Quat::Identity();
  Mat3 R = Mat3::Identity();  // of q
};

// How a body gets from one frame to the next: METHOD.md, Sec. 4.
enum class Motion : std::uint8_t { dynamic, quasi_static, held };

struct Body : RigidState {
  bool fixed = true;
  double mass = 0;              // [kg]
  Vec3 com = Vec3::Zero();      // mesh frame [m]
  Mat3 inertia = Mat3::Zero();  // about com, mesh axes [kg m^2]
  std::int32_t shell = -1, field = -1;
  double voxel = 1e-3;  // the smallest among fields it can touch [m]
  double radius = 0;    // farthest shell point from com [m]

  Motion motion = Motion::dynamic;
  bool translation_only = false;
  double max_step = 0;  // quasi-static: of any of its points in a frame [m]
  double drag = 0;      // of admittance hands: damping of the free body [N s/m]

  // Gathered in a frame: wrench about x and its derivatives by this body's own motion.
  Vec6 f = Vec6::Zero();
  Mat6 K = Mat6::Zero(), D = Mat6::Zero();

  double traverse_ns = 0;     // what the pairs of this body's shell took last
  bool pairs_shared = false;  // between the threads, then
  double shell_ns = 0;        // what traversal, contacts and weights of its shell took last

  double series_y[6] = {};   // `series`: the spring's extension in the last frame, a warm start
  ContactPort contact_port;  // of this body's shell
};

// What a thread needs to traverse a pair, and the points that it found to touch.
struct TraverseScratch {
  std::uint32_t *frontier = nullptr, *survivors = nullptr;  // (largest shell's groups)
  std::uint32_t *far = nullptr, *far_survivors = nullptr;   // (largest shell's groups)
  std::uint32_t* open_blocks = nullptr;                     // (largest shell's blocks)
  float* clearance = nullptr;                               // (largest shell's groups) [voxel]
  std::uint16_t *rows = nullptr, *near_rows = nullptr;      // (largest shell's groups)
  float* rest = nullptr;                                    // (largest shell's groups) [voxel]
  std::uint32_t* candidate = nullptr;                       // (candidate_capacity) shell's rows
  float* candidate_distance = nullptr;                      // [voxel]
  float *gradient_x = nullptr, *gradient_y = nullptr, *gradient_z = nullptr;
  std::size_t used = 0;  // candidates
};

// Whether a tier of spheres is worth testing: not where most of them survived the last time, until
// there are many more or it has been left out often enough to ask again. Either way the contacts
// are the same.
struct CullBypass {
  std::size_t asked = 0;  // spheres, when they were last tested
  int left_out = 0;       // how often it will be

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

// A shell body a against a field body b.
struct Pair {
  std::int32_t a = -1, b = -1;
  std::size_t begin = 0, end = 0;         // its rows among a's contacts
  std::size_t candidates = 0, first = 0;  // its rows among the candidates
  // Coherence of its traversal: METHOD.md, Sec. 6. No point of a group of the shell can touch
  // before the way has passed the group's expiry; a block's is the least of its groups'.
  // [voxel]
  float *group_expiry = nullptr, *block_expiry = nullptr;
  // Of a group, bit i: its point i was near when all of them were last looked at. None of the
  // others can touch before rest_expiry.
  std::uint16_t* near_rows = nullptr;
  float* rest_expiry = nullptr;
  double travelled = -1;                         // to the anchor; < 0: nothing is known
  std::size_t sampled = 0;                       // groups, when it was last traversed
  std::size_t open_blocks = 0, open_groups = 0;  // near, when groups were last looked at
  CullBypass cull_blocks, cull_groups;
  CullBypass look_at_rows;       // of points, by themselves
  int found_by = 0;              // whose scratch holds its candidates
  float missed = 0;              // of a coarse traversal: nothing left out is deeper [voxel]
  kernels::Affine last_place{};  // of the shell in the field, when it was last traversed
  kernels::Affine anchor{};      // the same, where it has stayed near to since
  kernels::Affine arms{};        // the same for arms of contacts [m], when they were gathered
  kernels::WrenchSum sum{};      // of its contacts
  // When both move: how each one's motion changes the other's wrench.
  Mat6 Kab = Mat6::Zero(), Kba = Mat6::Zero(), Dab = Mat6::Zero(), Dba = Mat6::Zero();
  // `series` lets the field bodies of one shell body feel one another: pair p's wrench on b_p
  // changes by left_p right_q with the motion of b_q, by beta left_p right_d_q with its velocity.
  Mat6 left = Mat6::Zero(), right = Mat6::Zero(), right_d = Mat6::Zero();
  // What telemetry and passivity read: the wrench on a and sum w k J J^T (`series`: its share of
  // the net stiffness, as if all fields of the shell body moved alike).
  Vec6 f = Vec6::Zero();
  Mat6 B = Mat6::Zero();
  Vec6 u = Vec6::Zero();       // a against b at a's centre of mass, before the step
  Vec3 arm = Vec3::Zero();     // x_a - x_b then
  Vec6 relief = Vec6::Zero();  // scratch of the passivity controller
};

struct Hand {
  std::int32_t body = -1;
  std::uint32_t mode = H6_IMPEDANCE;
  h6CouplingDef coupling{};  // with no zeros left
  double manipulandum_mass = 0.1, driver_stiffness = 0, driver_damping = 0;
  double motion_scale = 1, rotation_scale = 1;  // from the device to the scene
  h6DeviceSample sample{};                      // the last good one
  bool seen = false;                            // there was one
  bool clutched = false;                        // it moves alone
  HandFilter filter;
  RigidState manipulandum;     // where the hand holds the body's centre of mass; pseudo-admittance:
                               // a body of its own
  Vec6 wrench = Vec6::Zero();  // of the hand on the body
  bool passivity = false;
  HandPort port;
  h6Wrench told{};  // to the device, in the last frame
  // What stands last, and what it knows of the device. lost, overdue: for the next frame.
  h6SafetyDef safety{};
  DeviceWatch watch;
  bool lost = false;   // it could not be read or written
  double overdue = 0;  // a command comes so much too late [s]
  OutputGuard guard;
};

void set_rating(Hand& hand, const h6DeviceCapabilities& capabilities);
// So many seconds lie between the last command and the next one: late, when a frame is missing.
void note_interval(Hand& hand, double dt, double seconds);

// Moving bodies that pairs connect, solved together when there are not too many.
struct Island {
  std::int32_t body[kIslandBodies];
  int count;
};

}  // namespace h6

struct h6Session {
  const h6Model* model = nullptr;
  h6Allocator allocator{};
  h6ContactDef contact{};
  h6Integrator integrator = H6_IMPLICIT;
  h6Gradient gradient = H6_SYMMETRIC;
  double dt = 1e-3;
  h6::Vec3 gravity = h6::Vec3::Zero();
  bool net_stiffness = false;
  std::size_t max_contacts = 0;

  h6::Body* bodies = nullptr;
  std::size_t body_count = 0;
  h6::Pair* pairs = nullptr;  // those of one shell body stand together
  std::size_t pair_count = 0;
  h6::Hand* hands = nullptr;
  std::size_t hand_count = 0;
  h6::Island* islands = nullptr;
  std::size_t island_count = 0;
  h6::Contacts* contacts = nullptr;  // (bodies); capacity 0 without a shell

  // Scratch of traversal and one shell body's contacts. The helper's is there where a shell body
  // has several pairs; whoever finds them, candidates end up in the first.
  h6::TraverseScratch traversal[2];
  float *group_expiry = nullptr, *block_expiry = nullptr;  // of all pairs
  std::uint16_t* near_rows = nullptr;
  float* rest_expiry = nullptr;
  std::size_t candidate_capacity = 0;
  std::uint32_t *cluster_order = nullptr, *cluster_root = nullptr;  // (max_contacts)
  std::uint64_t* cluster_cell = nullptr;                            // (max_contacts)
  char* weigh_scratch = nullptr;                // weigh_scratch_bytes of max_contacts, or null
  std::size_t* slice_count = nullptr;           // (slices) survivors of each
  h6::kernels::WrenchSum* slice_sum = nullptr;  // (slices)

  std::uint32_t* shell_pairs = nullptr;  // (shell_count + 1) first pair of each shell body
  std::size_t shell_count = 0;
  // Null where there is one thread, or one shell body: shell_lanes.h.
  h6Session* lanes = nullptr;  // (2)
  h6::LaneScratch lane_scratch;
  bool in_lanes = false;  // in the last frame

  h6::ShareGate touching, weighing, summing;  // of groups, contacts, contacts
  h6::Anytime anytime;
  h6FrameReport report{};
  std::uint64_t frame = 0;
  h6::sched::TickLength tick_length;
  std::int64_t left_at = 0;  // when the last frame ended, by the clock [ns]
  bool rested = false;       // that was long before this one: caches are cold
  h6::sched::FrameTeam* team = nullptr;
  h6::sched::FrameTeam* alone = nullptr;  // of lanes
  void* memory = nullptr;
  std::size_t memory_bytes = 0;
};
