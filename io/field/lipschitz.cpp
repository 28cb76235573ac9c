// SPDX-License-Identifier: Apache-2.0
// lipschitz.cpp - see lipschitz.h.
#include "io/field/lipschitz.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

struct BrickNode {
  std::size_t cell;
  std::array<int, 3> at;  // in its brick
};
constexpr std::size_t kNoSample = SIZE_MAX;

class Edges {
 public:
  explicit Edges(const FieldData& field)
      : index_(field.brick_index),
        size_{std::size_t(field.bricks[0]), std::size_t(field.bricks[1]),
              std::size_t(field.bricks[2])},
        stride_{1, size_[0], size_[0] * size_[1]} {}

  std::size_t sample(const BrickNode& n) const {
    const std::int32_t row = index_[n.cell];
    if (row < 0) return kNoSample;
    return std::size_t(row) * 512 + std::size_t((n.at[2] * 8 + n.at[1]) * 8 + n.at[0]);
  }
  // Calls f(neighbour, its sample) for the neighbours of a node within the grid: all six, or only
  // those that stand behind it and those in other bricks.
  template <class F>
  void each(const BrickNode& node, bool all, F&& f) const {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int way : {-1, 1}) {
        BrickNode other = node;
        other.at[axis] += way;
        const bool leaves = other.at[axis] < 0 || other.at[axis] > 7;
        if (!all && !leaves && way < 0) continue;
        if (leaves) {
          const std::size_t place = node.cell / stride_[axis] % size_[axis];
          if (way < 0 ? place == 0 : place + 1 == size_[axis]) continue;
          other.cell = way < 0 ? node.cell - stride_[axis] : node.cell + stride_[axis];
          other.at[axis] = way < 0 ? 7 : 0;
        }
        f(other, sample(other));
      }
  }
  // Calls f(node, its sample, neighbour, its sample) for each edge of a brick's nodes.
  template <class F>
  void each_of_brick(std::size_t cell, F&& f) const {
    if (index_[cell] < 0) return;
    for (int n = 0; n < 512; ++n) {
      const BrickNode node{cell, {n % 8, n / 8 % 8, n / 64}};
      const std::size_t here = sample(node);
      each(node, false,
           [&](const BrickNode& other, std::size_t there) { f(node, here, other, there); });
    }
  }

 private:
  const Large<std::int32_t>& index_;
  const std::array<std::size_t, 3> size_, stride_;
};

// Lowers one of the two, or both, where they are steep. Returns whether they were.
bool lower_steep(float& a, float& b, float voxel) {
  if (!(std::fabs(a - b) > voxel * float(1 + kSteepSlack / 2))) return false;
  if ((a < 0) != (b < 0)) {
    const float share = voxel / (std::fabs(a) + std::fabs(b));
    a *= share, b *= share;
  } else {
    float& larger = std::fabs(a) > std::fabs(b) ? a : b;
    const float smaller = std::min(std::fabs(a), std::fabs(b));
    larger = std::copysign(smaller + voxel, larger);
  }
  return true;
}

}  // namespace

double steepest_edge(const FieldData& field, double beyond, unsigned threads) {
  const Edges edges(field);
  const std::size_t planes = std::size_t(field.bricks[2]);
  const std::size_t cells = field.brick_index.size() / planes;
  std::vector<double> most(planes);
  sched::parallel_for(planes, threads, [&](std::size_t plane) {
    double steepest = 0;
    for (std::size_t cell = plane * cells; cell < (plane + 1) * cells; ++cell)
      edges.each_of_brick(
          cell, [&](const BrickNode&, std::size_t a, const BrickNode&, std::size_t b) {
            const double here = double(field.samples[a]);
            const double rise = b != kNoSample ? std::fabs(double(field.samples[b]) - here)
                                               : beyond - std::fabs(here);
            steepest = std::max(steepest, rise);
          });
    most[plane] = steepest;
  });
  return *std::max_element(most.begin(), most.end()) / field.voxel_size;
}

void lower_steep_samples(FieldData& field) {
  const Edges edges(field);
  const float voxel = float(field.voxel_size);
  std::deque<BrickNode> open;  // nodes whose edges may have become steep
  const auto lower = [&](const BrickNode& x, std::size_t a, const BrickNode& y, std::size_t b) {
    if (b != kNoSample && lower_steep(field.samples[a], field.samples[b], voxel))
      open.push_back(x), open.push_back(y);
  };
  for (std::size_t cell = 0; cell < field.brick_index.size(); ++cell)
    edges.each_of_brick(cell, lower);
  for (std::size_t left = 8 * field.samples.size(); !open.empty() && left > 0; --left) {
    const BrickNode node = open.front();
    open.pop_front();
    edges.each(node, true, [&](const BrickNode& other, std::size_t b) {
      lower(node, edges.sample(node), other, b);
    });
  }
}

}  // namespace h6::io
