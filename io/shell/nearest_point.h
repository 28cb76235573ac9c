// SPDX-License-Identifier: Apache-2.0
// nearest_point.h - the nearest of many points, by a balanced kd-tree.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/shell/blue_noise.h"

namespace h6::io {

class NearestPoint {
 public:
  // Searches points[ids[0]], points[ids[1]], ...; `points` must outlive this. If the pulse stopped,
  // the tree is unfinished and must not be used.
  NearestPoint(std::span<const OrientedPoint> points, std::vector<std::uint32_t> ids,
               Pulse* pulse = nullptr);
  // The id of a point nearest to `query`. There must be at least one point.
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
