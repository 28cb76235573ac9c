// SPDX-License-Identifier: Apache-2.0
// winding.h - generalised winding numbers: how solid a place is inside a mesh with holes. Private
// to this folder.
#pragma once
#include "io/bake/grid.h"

namespace h6::io::bake {

// Of the surface as it is on creation; facets that it gets later do not count. In grid coordinates.
// Far triangles count as dipoles: G. Barill et al., "Fast winding numbers for soups and clouds",
// 2018.
class Winding {
 public:
  Winding(const Surface& surface, unsigned threads);

  // The solid angle of all triangles around p over 4 pi: 1 inside a closed mesh that is wound
  // outwards, 0 outside, and in between near holes. Off by 0.05 at most.
  double at(const Vec3& p) const;
  // Whether p is more inside than outside. Meshes wound inwards are as good.
  bool inside(const Vec3& p) const { return turn_ * at(p) > 0.5; }
  // Whether the winding tells a solid: half a voxel before and behind most of the surface it is
  // nearly a whole number, which no sheet and no mix of windings has.
  bool trusted() const { return trusted_; }

 private:
  struct Cluster {
    std::array<float, 3> middle;
    float radius;
    std::array<float, 3> dipole;  // sum of area normals over 4 pi
  };
  // The corners of a leaf's triangles, each vertex once: most are shared, and their distances cost
  // more than all else.
  struct Leaf {
    std::uint32_t first = 0;                    // in leaf_vertex_
    std::uint32_t vertices = 0, triangles = 0;  // at most 24 and 8
    std::array<std::uint8_t, 24> corner{};      // (3 x triangles) from `first`
  };
  struct Turns {
    double x = 1, y = 0;  // the last turn, begun; of any length
    int full = 0;
  };
  void make_leaves();
  void turn(const Leaf& leaf, const Vec3& p, Turns& sum) const;
  struct Look {
    bool outwards = false, inwards = false;  // the ways in which it may be wound
  };
  Look look(std::uint32_t triangle) const;
  void look_at_surface();

  const Surface& surface_;
  std::size_t count_;
  Large<std::uint32_t> triangle_;  // in the order of leaves
  std::vector<Leaf> leaf_;
  std::vector<Vec3> leaf_vertex_;
  std::vector<std::vector<Cluster>> level_;  // of eight triangles, of eight of these, ...
  double turn_ = 1;
  bool trusted_ = false;
};

}  // namespace h6::io::bake
