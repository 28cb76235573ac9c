// SPDX-License-Identifier: Apache-2.0
// gauss_tree_stages.h - functions shared by the files of gauss_tree.h.
#pragma once
#include "kernels/weights/gauss_tree.h"

namespace h6::kernels {

// Index of a moment in GaussLevel::moment. a, b: V - C over N and over T. A density over one sphere
// has the first two.
enum GaussMoment {
  kMass = 0,  // sum s
  kA2,        // sum s |a|^2
  kB2,        // sum s |b|^2
  kA2B2,      // sum s |a|^2 |b|^2
  kAB2,       // sum s |b|^2 a        3
  kBA2 = 7,   // sum s |a|^2 b        3
  kAB = 10,   // sum s a b^T          9, by rows
};

// Column k of a leaf; column g.axes holds the shares.
inline float* leaf_column(const GaussDensity& g, std::size_t leaf, int k) {
  return g.leaves + (leaf * (g.axes + 1) + k) * kGaussLeaf;
}

float gauss_per_share(const DirectionsView& c);
// Fills g.source: contacts in the order of the curve.
void gauss_sort(const GaussDensity& g, std::size_t count);
void gauss_build_leaves(const GaussTree& tree, const GaussDensity& g, std::size_t begin,
                        std::size_t end);
void gauss_build_levels(const GaussDensity& g);
void gauss_sum_leaves(const GaussDensity& g, std::size_t count, std::size_t begin, std::size_t end);
void gauss_weigh_rows(const GaussTree& tree, std::size_t begin, std::size_t end);

}  // namespace h6::kernels
