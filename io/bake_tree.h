// bake_tree.h - the distance of any point to the surface. Private to bake_*.cpp.
#pragma once
#include "io/bake_grid.h"
#include "kernels/nearest_eight.h"

namespace h6::io::bake {

// Triangles in the order of Hilbert's curve, eight to a leaf, eight leaves or nodes to a node: no pointers, every
// level is an array. The nearest distance does not depend on where a search starts.
class TriangleTree {
 public:
  TriangleTree(const Surface& surface, const Grid& grid, unsigned threads);

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  struct Found {
    float squared;          // of a lower bound of the distance [voxel^2]
    std::uint32_t nearest;  // place in this tree
  };
  // Weighs the eight triangles around a place.
  void try_around(const double (&p)[3], std::uint32_t place, Found& found) const;
  // A lower bound of the distance [voxel], by less than kTight. `found`: on entry the square of
  // anything above the distance, or what try_around left; on return a place to start from at
  // points near by.
  double search(const double (&p)[3], Found& found) const;
  static constexpr double kTight = 0.02;

 private:
  double squared_to(const double (&p)[3], std::uint32_t place) const;
  double squared_about(const float (&at)[3], std::uint32_t place) const;
  void weigh(std::uint32_t leaf, const float (&at)[3], Found& found) const;
  template <class Look>
  void walk(const float (&at)[3], const float& most, Look&& look) const;
  double search_exactly(const double (&p)[3], double best2, std::uint32_t& nearest) const;

  const Surface& surface_;
  double middle_[3];                     // float coordinates are about this
  Large<std::uint32_t> triangle_;        // place -> triangle
  Large<kernels::EightTriangles> leaf_;
  Large<kernels::EightTurnedBoxes> around_leaf_;
  std::vector<Large<kernels::EightBoxes>> level_;  // last: one node
};

}  // namespace h6::io::bake
