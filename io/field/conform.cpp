// SPDX-License-Identifier: Apache-2.0
#include "io/field/conform.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

// Reads the field at fine nodes, by the cells around them.
class Cells {
 public:
  explicit Cells(const FieldData& field) : field_(field) {}

  // The value at a node as the coarsest cell that touches it has it; none where no cell there is
  // coarser than `own` samples a voxel.
  std::optional<float> coarser(const GridNode& node, int own) const {
    int least = own;
    GridNode cell{};
    const float* samples = nullptr;
    for (int i = 0; i < 8; ++i) {
      GridNode c;
      bool touches = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const int back = i >> k & 1;
        c[k] = (node[k] >> 2) - back;
        touches = touches && (back == 0 || (node[k] & 3) == 0);
      }
      if (!touches) continue;
      const float* in = nullptr;
      const int factor = factor_of(c, in);
      if (factor == 0 || factor >= least) continue;
      least = factor;
      cell = c;
      samples = in;
    }
    if (least == own) return std::nullopt;
    return interpolated(node, cell, least, samples);
  }

 private:
  // Samples a voxel in a cell; 0 where there is no brick, or no whole cell at the band's end.
  int factor_of(const GridNode& cell, const float*& samples) const {
    std::size_t brick = 0, local = 0;
    for (std::size_t k = 3; k-- > 0;) {
      if (cell[k] < 0 || cell[k] >= 8 * field_.bricks[k]) return 0;
      brick = brick * std::size_t(field_.bricks[k]) + std::size_t(cell[k] >> 3);
      local = local * 8 + std::size_t(cell[k] & 7);
    }
    const std::int32_t row = field_.brick_index[brick];
    if (row < 0) return 0;
    const std::int32_t refined = field_.refined[std::size_t(row)];
    const std::int32_t i = refined < 0 ? 0 : field_.fine_index[512 * std::size_t(refined) + local];
    if (i < 0) return 4;
    if (i > 0) samples = &field_.halves[27 * std::size_t(i - 1)];
    if (i > 0) return 2;
    for (int c = 0; c < 8; ++c)
      if (corner(cell, c) == nullptr) return 0;
    return 1;
  }

  const float* corner(const GridNode& cell, int c) const {
    return coarse_node(
        field_, {4 * (cell[0] + (c & 1)), 4 * (cell[1] + (c >> 1 & 1)), 4 * (cell[2] + (c >> 2))});
  }

  float interpolated(const GridNode& node, const GridNode& cell, int factor,
                     const float* samples) const {
    const int step = 4 / factor, side = factor + 1;
    int low[3];
    float t[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const int at = node[k] - 4 * cell[k];
      low[k] = std::min(at / step, factor - 1);
      t[k] = float(at - step * low[k]) / float(step);
    }
    float sum = 0;
    for (int c = 0; c < 8; ++c) {
      float weight = 1;
      for (int k = 0; k < 3; ++k) weight *= (c >> k & 1) != 0 ? t[k] : 1 - t[k];
      if (weight == 0) continue;
      const int x = low[0] + (c & 1), y = low[1] + (c >> 1 & 1), z = low[2] + (c >> 2);
      sum += weight * (factor == 1 ? *corner(cell, c) : samples[(z * side + y) * side + x]);
    }
    return sum;
  }

  const FieldData& field_;
};

// All cells of `factor` in one refined brick, whose first node is `from`.
void conform_brick(const Cells& cells, const GridNode& from, const std::int32_t* index, int factor,
                   FieldData& field) {
  const int side = factor + 1, step = 4 / factor;
  for (int c = 0; c < 512; ++c) {
    if (factor == 2 ? index[c] <= 0 : index[c] >= 0) continue;
    float* values = factor == 2 ? &field.halves[27 * std::size_t(index[c] - 1)]
                                : &field.quarters[125 * std::size_t(-1 - index[c])];
    for (int n = 0; n < side * side * side; ++n) {
      const int at[3] = {n % side, n / side % side, n / side / side};
      bool within = true;
      for (const int a : at) within = within && a > 0 && a < factor;
      if (within) continue;
      const GridNode node{from[0] + 4 * (c % 8) + step * at[0],
                          from[1] + 4 * (c / 8 % 8) + step * at[1],
                          from[2] + 4 * (c / 64) + step * at[2]};
      if (const auto v = cells.coarser(node, factor)) values[n] = *v;
    }
  }
}

}  // namespace

const float* coarse_node(const FieldData& field, const GridNode& node) {
  std::size_t cell = 0, local = 0;
  for (std::size_t k = 3; k-- > 0;) {
    const int n = node[k] >> 2;
    if (n < 0 || n >= 8 * field.bricks[k]) return nullptr;
    cell = cell * std::size_t(field.bricks[k]) + std::size_t(n >> 3);
    local = local * 8 + std::size_t(n & 7);
  }
  const std::int32_t row = field.brick_index[cell];
  return row < 0 ? nullptr : &field.samples[std::size_t(row) * 512 + local];
}

void conform(unsigned threads, FieldData& field) {
  struct Brick {
    GridNode from;
    const std::int32_t* index;
  };
  std::vector<Brick> bricks;
  for (std::size_t c = 0; c < field.brick_index.size() && !field.refined.empty(); ++c) {
    const std::int32_t row = field.brick_index[c];
    const std::int32_t refined = row < 0 ? -1 : field.refined[std::size_t(row)];
    if (refined < 0) continue;
    const GridNode at = place_of(c, field.bricks);
    bricks.push_back(
        {{32 * at[0], 32 * at[1], 32 * at[2]}, &field.fine_index[512 * std::size_t(refined)]});
  }
  const Cells cells(field);
  // Quarters read halves, so halves come first. Cells of one kind do not read each other.
  for (const int factor : {2, 4})
    sched::parallel_for(bricks.size(), threads, [&](std::size_t b) {
      conform_brick(cells, bricks[b].from, bricks[b].index, factor, field);
    });
}

}  // namespace h6::io
