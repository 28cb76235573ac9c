// SPDX-License-Identifier: Apache-2.0
// gauss_tree.h - the weights of gauss_weights.h for many contacts, in nearly linear time.
//
// Contacts are sorted along a space-filling curve over the Gauss map, 16 to a leaf, 16 leaves to a
// node, and so on. A hat is a quadratic inside its support, so the contribution of a node wholly
// inside follows exactly from its moments:
//     sum_j s_j (e^2 - |V_j - V|^2) = S (e^2 - |V - C|^2) - sum_j s_j |V_j - C|^2,  C the centroid
// and the product of two hats needs the moments up to |N|^2 |T|^2. Nodes wholly outside add
// nothing. Leaves that the edge of a support runs through are summed contact by contact. From
// kGaussMany contacts on, nodes over one sphere that are small beside the hat count there with the
// mean of e^2 - |V_j - V|^2, or not at all where that is below 0. That is never more than their
// contacts give one by one, so no contact is hidden by it. In a clump weights are at most 1.2 % too
// large. Where thousands lie at the very edge of a contact's hat, it can weigh up to 1.
//
// Work is cut into stages and slices. Stages run in order; slices of one stage write to different
// places and may run at the same time. The bits do not depend on which thread runs a slice.
// gauss_weights_tree below is the loop.
#pragma once
#include "kernels/weights/gauss_weights.h"

namespace h6::kernels {

inline constexpr int kGaussStages = 5;
inline constexpr std::size_t kGaussLeaf = 16;  // contacts a leaf, children a node
inline constexpr int kGaussLevels = 8;         // 16^8 contacts
inline constexpr int kGaussMoments = 19;       // of a product hat; the others have 2

inline constexpr std::size_t kGaussMany = 16000;  // contacts from which small nodes count whole

// Nodes of one level, columns of `count` rows padded to a multiple of 16 with rows of weight 0.
struct GaussLevel {
  std::size_t count;
  float *centre[6], *rest[6];  // weighted centroid, and its rounding error
  float* radius[2];            // around it, over contacts of share > 0
  float* moment[kGaussMoments];
};

// The density of one hat, over one sphere or the product of both.
struct GaussDensity {
  int axes;                // 3, or 6: N and T
  const float* column[6];  // in the caller's order
  float width[2];
  bool unit;      // all s_j are 1
  float* uneven;  // how far a square of a length over the first sphere is from 1, at most
  // In order of the curve, leaf by leaf: 16 of each column, then 16 times s_j over the largest s.
  float* leaves;
  std::uint32_t *source, *key;
  std::uint64_t* order[2];
  GaussLevel level[kGaussLevels];
  int levels;
  float* phi;  // in the contacts' order
};

struct GaussTree {
  DirectionsView contacts;
  Hat hat;
  int densities;  // 2 for Hat::sum
  GaussDensity density[2];
  float* per_share;  // 1 / the largest s
  float* weight;
};

// Bytes of `memory`: at most 120 a contact and 20,000, any alignment.
std::size_t gauss_tree_bytes(std::size_t count, Hat hat);

// Takes the arguments of gauss_weights_ref, except geodesic, which is not quadratic. weight
// (count).
GaussTree gauss_tree(const DirectionsView& c, Hat hat, const GaussWidths& widths, void* memory,
                     float* weight);
std::size_t gauss_tree_slices(const GaussTree& tree, int stage);
void gauss_tree_run(const GaussTree& tree, int stage, std::size_t slice);

// All stages on the caller's thread. The specification is gauss_weights_ref.
inline void gauss_weights_tree(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                               void* memory, float* weight) {
  const GaussTree tree = gauss_tree(c, hat, widths, memory, weight);
  for (int stage = 0; stage < kGaussStages; ++stage)
    for (std::size_t i = 0; i < gauss_tree_slices(tree, stage); ++i) gauss_tree_run(tree, stage, i);
}

}  // namespace h6::kernels
