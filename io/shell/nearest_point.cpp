// SPDX-License-Identifier: Apache-2.0
// nearest_point.cpp - nodes split at the median along the widest axis, by rank and not by
// coordinate, so that coinciding points make no deep tree. Leaves have eight points.
#include "io/shell/nearest_point.h"

#include <algorithm>
#include <cmath>

namespace h6::io {
namespace {
constexpr std::uint32_t leaf_size = 8;

// In double, where differences of floats are exact, so that only real ties are ties.
double distance2(const float a[3], const float b[3]) {
  double sum = 0;
  for (int k = 0; k < 3; ++k) {
    const double d = double(a[k]) - double(b[k]);
    sum += d * d;
  }
  return sum;
}
}  // namespace

NearestPoint::NearestPoint(std::span<const OrientedPoint> points, std::vector<std::uint32_t> ids,
                           Pulse* pulse)
    : points_(points), pulse_(pulse), ids_(std::move(ids)) {
  nodes_.reserve(ids_.size() / 2 + 1);
  build(0, std::uint32_t(ids_.size()));
  if (!alive(pulse_)) return;
  leaves_.reserve(ids_.size());
  for (const std::uint32_t id : ids_) {
    const float* p = points_[id].p;
    leaves_.push_back({{p[0], p[1], p[2]}, id});
  }
}

std::uint32_t NearestPoint::build(std::uint32_t first, std::uint32_t count) {
  const auto at = std::uint32_t(nodes_.size());
  nodes_.push_back({0, first, count, 0, 0});
  if (count <= leaf_size || (count > 4096 && !alive(pulse_))) return at;
  int axis = 0;
  float widest = -1;
  for (int a = 0; a < 3; ++a) {
    float low = INFINITY, high = -INFINITY;
    for (std::uint32_t i = first; i < first + count; ++i) {
      low = std::min(low, points_[ids_[i]].p[a]);
      high = std::max(high, points_[ids_[i]].p[a]);
    }
    if (high - low > widest) widest = high - low, axis = a;
  }
  const auto begin = ids_.begin() + first, middle = begin + count / 2;
  std::nth_element(begin, middle, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    const float pa = points_[a].p[axis], pb = points_[b].p[axis];
    return pa != pb ? pa < pb : a < b;
  });
  nodes_[at].axis = axis;
  nodes_[at].split = points_[*middle].p[axis];
  build(first, count / 2);
  const std::uint32_t right = build(first + count / 2, count - count / 2);
  nodes_[at].right = right;
  return at;
}

std::uint32_t NearestPoint::operator()(const float query[3]) const {
  struct Later {
    std::uint32_t node;
    double distance2;
  };
  Later stack[64];  // the tree is balanced: never deeper than 32
  int waiting = 0;
  double best = INFINITY;
  std::uint32_t best_id = ids_[0];
  stack[waiting++] = {0, 0};
  while (waiting > 0) {
    const Later next = stack[--waiting];
    if (next.distance2 >= best) continue;
    std::uint32_t at = next.node;
    while (nodes_[at].right != 0) {
      const Node& node = nodes_[at];
      const double gap = double(query[node.axis]) - double(node.split);
      stack[waiting++] = {gap < 0 ? node.right : at + 1, gap * gap};
      at = gap < 0 ? at + 1 : node.right;
    }
    for (std::uint32_t i = nodes_[at].first; i < nodes_[at].first + nodes_[at].count; ++i) {
      const double d2 = distance2(leaves_[i].p, query);
      if (d2 < best) best = d2, best_id = leaves_[i].id;
    }
  }
  return best_id;
}

}  // namespace h6::io
