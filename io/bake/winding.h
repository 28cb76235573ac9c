// SPDX-License-Identifier: Apache-2.0
// winding.h - generalised winding numbers: how solid a place is inside a mesh with holes. Private
// to this folder.
#pragma once
#include <vector>

#include "io/bake/grid.h"
#include "kernels/bake/winding_numbers.h"

namespace h6::io::bake {

// Of the surface as it is on creation; facets that it gets later do not count. In grid coordinates.
class Winding {
 public:
  Winding(const Surface& surface, unsigned threads);

  // The solid angle of all triangles around p over 4 pi: 1 inside a closed mesh that is wound
  // outwards, 0 outside, and in between near holes. Off by 0.05 at most.
  double at(const Vec3& p) const;
  // Bit i: node i of the 4 x 2 x 2, x fastest, that begin at `first`, `stride` apart (1 or 2), is
  // more inside than outside. Meshes wound inwards are as good. One query of all costs little more
  // than one of a single node.
  std::uint32_t inside(const std::array<int, 3>& first, int stride = 1) const;
  // Whether the winding tells a solid: half a voxel before and behind most of the surface it is
  // nearly a whole number, which no sheet and no mix of windings has.
  bool trusted() const { return trusted_; }

 private:
  using Cluster = kernels::WindingCluster;
  using Leaf = kernels::WindingLeaf;
  // Places around one of them, and a ball that holds them.
  struct Places {
    kernels::WindingPlaces offsets;
    Vec3 middle;
    double radius;
  };
  static Places box(int stride);
  void numbers(const Vec3& base, const Places& places,
               float (&number)[kernels::kWindingPlaces]) const;
  void make_leaves();
  struct Look {
    bool outwards = false, inwards = false;  // the ways in which it may be wound
  };
  Look look(std::uint32_t triangle) const;
  void look_at_surface();

  const Surface& surface_;
  std::size_t count_;
  Large<std::uint32_t> triangle_;  // in the order of leaves
  std::vector<Leaf> leaf_;
  std::vector<Cluster> cluster_;      // of eight triangles, then of eight of these, ...
  std::vector<std::uint32_t> level_;  // the first cluster of each level, and their number
  Places box_[2] = {box(1), box(2)};
  double turn_ = 1;
  bool trusted_ = false;
};

}  // namespace h6::io::bake
