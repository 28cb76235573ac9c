// bake_tree.h - the distance of any point to the surface, in double. Private to bake_*.cpp.
#pragma once
#include "io/bake_grid.h"
#include "kernels/nearest_eight.h"

namespace h6::io::bake {

// Triangles in Morton order, eight to a leaf, eight leaves or nodes to a node: no pointers, every
// level is an array. The nearest distance does not depend on where a search starts.
class TriangleTree {
 public:
  TriangleTree(const Surface& surface, const Grid& grid, unsigned threads);

  // `best2`: on entry an upper bound of the squared distance (that to `nearest`, say), on return
  // the squared distance [voxel^2]. `nearest`: place in this tree.
  struct Found {
    double best2;
    std::uint32_t nearest;
  };
  void search(const double (&p)[3], Found& found) const;
  double squared_to(const double (&p)[3], std::uint32_t place) const;

 private:
  const Surface& surface_;
  double middle_[3];                     // float coordinates are about this
  std::vector<std::uint32_t> triangle_;  // place -> triangle
  std::vector<kernels::EightTriangles> leaf_;
  std::vector<std::vector<kernels::EightBoxes>> level_;  // 0: boxes of leaves; last: one node
};

}  // namespace h6::io::bake
