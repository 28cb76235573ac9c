// SPDX-License-Identifier: Apache-2.0
// nearest_triangle.h - the exact nearest point of a mesh, by a tree of boxes.
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
  // Takes the triangles that have area. Indices must be in range, vertices finite. When the pulse
  // stops, the tree is incomplete and must not be used.
  NearestTriangle(const Mesh& mesh, unsigned threads, Pulse* pulse = nullptr);
  bool empty() const { return corners_.empty(); }
  // The nearest triangle closer than `within`; of equally near ones, that of the lowest number.
  NearTriangle operator()(const Vec3& place,
                          double within = std::numeric_limits<double>::infinity()) const;

 private:
  // The box of triangles [first, first + count). The first child follows its node; `second` is the
  // place of the other one.
  struct Node {
    float low[3], high[3];
    std::uint32_t first, count, second;  // second is 0 in a leaf
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
