// SPDX-License-Identifier: Apache-2.0
// tree.h - the distance of grid nodes to the surface. Private to this folder.
#pragma once
#include <span>

#include "io/bake/grid.h"
#include "kernels/bake/nearest_eight.h"

namespace h6::io::bake {

// leaves.cpp: all triangles, in an order in which runs of 8, 64 and 512 have small boxes around
// them.
Large<std::uint32_t> order_for_leaves(const Surface& surface, unsigned threads);

// A tree without pointers: each level is an array, a leaf has eight triangles, a node has eight
// leaves or nodes, and the triangles follow Hilbert's curve. The distance it finds does not depend
// on where a search starts. io/mesh/ray_scene.h says when to use which of the two searches.
class TriangleTree {
 public:
  TriangleTree(const Surface& surface, const Grid& grid, unsigned threads);

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  using Found = kernels::NearestFound;  // [voxel^2]; place in this tree
  // Returns a lower bound of the distance [voxel], less than kTight below it; or 0, as soon as a
  // triangle in one of the starting leaves is within `enough`. `start`: places of triangles that
  // are probably near, at most kStarts, no two of them together(). `found`: on entry, `squared` is
  // the square of any upper bound of the distance; on return, `place` is a start for points near
  // by.
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
  double middle_[3];               // origin of the float coordinates
  Large<std::uint32_t> triangle_;  // place -> triangle
  Large<kernels::EightTriangles> leaf_;
  Large<kernels::EightTurnedBoxes> around_leaf_;
  std::vector<Large<kernels::EightBoxes>> level_;  // last: one node
  kernels::NearestTree tree_;                      // views of all of these
};

}  // namespace h6::io::bake
