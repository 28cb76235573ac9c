// SPDX-License-Identifier: Apache-2.0
// nearest_point.h - the nearest of many points, for any arrangement of them: a balanced kd-tree.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/shell/blue_noise.h"

namespace h6::io {

class NearestPoint {
 public:
  // Of points[ids[0]], points[ids[1]], ...; `points` must outlive this.
  // After the pulse stopped it must not be asked.
  NearestPoint(std::span<const OrientedPoint> points, std::vector<std::uint32_t> ids,
               Pulse* pulse = nullptr);
  // The id of a point nearest to points[query]; there must be at least one.
  std::uint32_t operator()(const float query[3]) const;

 private:
  struct Node {
    float split;
    std::uint32_t first, count;
    std::uint32_t right;  // the left child follows its parent; 0: a leaf
    int axis;
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t count);
  std::span<const OrientedPoint> points_;
  Pulse* pulse_;
  std::vector<std::uint32_t> ids_;
  std::vector<Node> nodes_;
  struct Leaf {
    float p[3];
    std::uint32_t id;
  };
  std::vector<Leaf> leaves_;  // in the order of ids_
};

}  // namespace h6::io
