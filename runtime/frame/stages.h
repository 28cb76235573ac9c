// SPDX-License-Identifier: Apache-2.0
// stages.h - the stages of a frame, each in a file of its own; frame.cpp puts them in order.
#pragma once
#include "runtime/frame/session.h"

namespace h6 {

inline constexpr std::size_t kTouchSlice = 32;  // groups sampled at a time: some 2 us
inline constexpr std::size_t kSumSlice = 1024;  // contacts summed at a time; added in order

// Shell points that touch a field: rows of the last level with a distance below zero, or (series)
// below the margin.
void traverse(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Depth, normal, gradient, arm of each; keeps the deepest when there are too many.
void gather_contacts(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Shares of stiffness over all contacts of one shell body, all fields pooled. METHOD.md, Sec. 3.
void weigh_contacts(h6Session& s, std::size_t first_pair, std::size_t end_pair);
void weigh_series(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Wrench of a pair's contacts with its derivatives: summed, which reads no other pair's, then added
// to both bodies, in the order of pairs.
void sum_contacts(h6Session& s, Pair& pair);
void add_wrench(h6Session& s, Pair& pair);
// The same for all pairs of a shell body, which one solve connects.
void sum_series(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// What the two do with a pair's sums, from wherever these come: shares go to both bodies and, where
// both move, between them. join_series ends it once all pairs of the shell body are spread.
void spread_wrench(h6Session& s, Pair& pair, const kernels::WrenchSum& sum);
void spread_series(h6Session& s, Pair& pair, const kernels::WrenchSum& sum);
void join_series(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// A device's sample becomes the hand's. What is not finite is not used: the hand stays where it was
// last good, its wrench is none.
void accept(h6Session& s, Hand& hand, const h6DeviceSample& given);
// What the hand feels is its wrench on the body turned round; that, or where its device should be.
void send(h6Session& s, Hand& hand, h6DeviceCommand* command);
// Direct: puts the body where the hand is, before contacts are found.
void hold(h6Session& s, Hand& hand);
// What the hand does to its body, by the coupling and the device mode. METHOD.md, Sec. 4.
void couple(h6Session& s, Hand& hand);
// Pseudo-admittance: one time step of the manipulandum between the driver's coupling and the body.
void step_manipulandum(h6Session& s, Hand& hand);
// Admittance modes: where the safety chain held the device back, that which it follows is held back
// too, by at most what it moved in this frame.
void follow_device(Hand& hand, const Body& body, RigidState& state, const h6BodyState& wanted,
                   const h6DeviceCommand& passed, double h);
// One time step of all moving bodies.
void step_bodies(h6Session& s);
// One step of a body without mass towards the pose in which all that acts on it balances.
void step_static(h6Session& s, Body& body);

// A hand's virtual coupling: the wrench that pulls one state to another, and its derivatives by the
// pose and velocity of the one that is pulled.
struct Pull {
  Vec6 wrench = Vec6::Zero();
  Mat6 K, D;
  bool cut = false;
};
Pull pull_of(const h6Session& s, const Hand& hand, const RigidState& target,
             const RigidState& pulled);

// Of something with this mass in this state whose inertia is the body's in the ratio of the masses:
// its mass matrix, and [0; w x I w]. And (v, w) of anything. World frame.
Mat6 mass_matrix(const Body& body, const RigidState& state, double mass);
Vec6 gyroscopic(const Body& body, const RigidState& state, double mass);
Vec6 velocity(const RigidState& state);
// Changes the velocity, then moves by it for h seconds; false when that leaves the numbers: then
// it rests where it was.
bool move_or_rest(RigidState& state, const Vec6& du, double h, bool translation_only);

// S = [I 0; [x_a - x_b]x I]: carries a wrench about a's centre of mass to b's.
Mat6 arm_shift(const h6Session& s, const Pair& pair);
// Velocity of a against b at a's centre of mass: u_a - S^T u_b.
Vec6 pair_velocity(const h6Session& s, const Pair& pair);
// What turning the arms and normals does to an elastic wrench f on a: a.K, b.K, pair.Kba.
void add_geometric_terms(h6Session& s, Pair& pair, const Vec6& f);

// How many pairs from `pair` on belong to the same shell body.
inline std::size_t pairs_of_shell(const h6Session& s, std::size_t pair) {
  std::size_t end = pair + 1;
  while (end < s.pair_count && s.pairs[end].a == s.pairs[pair].a) ++end;
  return end;
}

// A world-frame pose of a body's mesh frame, and back.
h6Pose mesh_pose(const Body& body);
// The same of something else that the body's mesh frame hangs on; and of that frame's origin.
h6Pose mesh_pose(const Body& body, const RigidState& state);
h6Velocity mesh_velocity(const Body& body, const RigidState& state);
void set_mesh_pose(Body& body, const h6Pose& pose);
std::uint64_t state_hash(const h6Session& s, const h6DeviceSample* samples);

h6Status frame(h6Session& s, const h6DeviceSample* samples, h6DeviceCommand* commands);

}  // namespace h6
