// SPDX-License-Identifier: Apache-2.0
// tree.h - the distance of any point to the surface. Private to bake_*.cpp.
#pragma once
#include <span>

#include "io/bake/grid.h"
#include "kernels/bake/nearest_eight.h"

namespace h6::io::bake {

// Triangles in the order of Hilbert's curve, eight to a leaf, eight leaves or nodes to a node: no
// pointers between nodes, every level is an array. The nearest distance does not depend on where a
// search starts.
class TriangleTree {
 public:
  TriangleTree(const Surface& surface, const Grid& grid, unsigned threads);

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  using Found = kernels::NearestFound;  // [voxel^2]; place in this tree
  // A lower bound of the distance [voxel], by less than kTight. `found`: on entry the square of
  // anything above the distance; on return a place to start from at points near by. Looks around
  // up to kStarts places first, no two of them together(), and where one of these is within
  // `enough`, no further: 0.
  static constexpr std::size_t kStarts = 4;
  double search(const double (&p)[3], std::span<const std::uint32_t> start, double enough,
                Found& found) const;
  static bool together(std::uint32_t place, std::uint32_t other) { return place / 8 == other / 8; }
  static constexpr double kTight = 0.02;

 private:
  double squared_to(const double (&p)[3], std::uint32_t place) const;
  template <class Look>
  void walk(const float (&at)[3], const float& most, Look&& look) const;
  double search_exactly(const double (&p)[3], double best2, std::uint32_t& nearest) const;

  const Surface& surface_;
  double middle_[3];               // float coordinates are about this
  Large<std::uint32_t> triangle_;  // place -> triangle
  Large<kernels::EightTriangles> leaf_;
  Large<kernels::EightTurnedBoxes> around_leaf_;
  std::vector<Large<kernels::EightBoxes>> level_;  // last: one node
  kernels::NearestTree tree_;                      // all of this
};

}  // namespace h6::io::bake
