// stages.h - the stages of a frame, each in a file of its own; frame.cpp puts them in order.
#pragma once
#include "runtime/session.h"

namespace h6 {

// Shell points that touch a field: rows of the last level with a distance below zero.
void traverse(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Depth, normal, gradient, arm of each; keeps the deepest when there are too many.
void gather_contacts(h6Session& s, std::size_t first_pair, std::size_t end_pair);
// Shares of stiffness over all contacts of one shell body, all fields pooled. METHOD.md, Sec. 3.
void weigh_contacts(h6Session& s, std::int32_t shell_body);
// Wrench of a pair's contacts on both bodies, with its derivatives.
void sum_wrench(h6Session& s, Pair& pair);
// Virtual coupling of a hand with its body.
void couple(h6Session& s, Hand& hand);
// One time step of all moving bodies.
void step_bodies(h6Session& s);

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
