// SPDX-License-Identifier: Apache-2.0
// nearest_triangle.h - the point of a mesh nearest to a place, exactly: a tree of boxes.
#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "io/file/pulse.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct NearTriangle {
  std::uint32_t triangle = UINT32_MAX;  // UINT32_MAX: none within reach
  Vec3 point{};
  double distance2 = std::numeric_limits<double>::infinity();
};

class NearestTriangle {
 public:
  // Of the mesh's triangles that have area. Indices must be in range, vertices finite. After the
  // pulse stopped it must not be asked.
  NearestTriangle(const Mesh& mesh, unsigned threads, Pulse* pulse = nullptr);
  bool empty() const { return corners_.empty(); }
  // The first of equally near ones. Nothing at `within` or farther is found.
  NearTriangle operator()(const Vec3& place,
                          double within = std::numeric_limits<double>::infinity()) const;

 private:
  struct Node {  // of items [first, first + count); a node's second child follows all of its first
    float low[3], high[3];
    std::uint32_t first, count, second;  // second 0: a leaf
  };
  struct Corners {
    Vec3 a, b, c, normal;  // unit
    std::uint32_t triangle;
  };
  void build(std::uint32_t node, std::uint32_t first, std::uint32_t count, std::uint32_t stop,
             std::vector<std::array<std::uint32_t, 3>>* later);
  void fit(Node& node) const;
  Pulse* pulse_;
  std::vector<Corners> corners_;  // in the order of leaves
  std::vector<Node> nodes_;
};

}  // namespace h6::io
