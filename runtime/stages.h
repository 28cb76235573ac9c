// stages.h - the stages of a frame, each in a file of its own; frame.cpp puts them in order.
#pragma once
#include "runtime/session.h"

namespace h6 {

// Shell points that touch a field: rows of the last level with a distance below zero, or (series)
// below the margin.
void traverse(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Depth, normal, gradient, arm of each; keeps the deepest when there are too many.
void gather_contacts(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Shares of stiffness over all contacts of one shell body, all fields pooled. METHOD.md, Sec. 3.
void weigh_contacts(h6Session& s, std::size_t first_pair, std::size_t end_pair);
void weigh_series(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Wrench of a pair's contacts on both bodies, with its derivatives.
void sum_wrench(h6Session& s, Pair& pair);
// The same for all pairs of a shell body, which one solve connects.
void sum_series(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Virtual coupling of a hand with its body.
void couple(h6Session& s, Hand& hand);
// One time step of all moving bodies.
void step_bodies(h6Session& s);

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
void set_mesh_pose(Body& body, const h6Pose& pose);
std::uint64_t state_hash(const h6Session& s);

h6Status frame(h6Session& s, const h6DeviceSample* samples, h6DeviceCommand* commands);

}  // namespace h6
