// SPDX-License-Identifier: Apache-2.0
#include "io/field/conform.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

// A cell and how finely it is sampled: samples a voxel, 0 where it has none.
struct Sampled {
  int factor = 0;
  const float* halves = nullptr;  // factor 2
  float corners[8] = {};          // factor 1
};

// The 3 x 3 x 3 cells around one, x fastest.
struct Around {
  Sampled cell[27];
  // Bit i: cell i has one sample a voxel; two, and the one in the middle has four.
  std::uint32_t ones = 0, twos = 0;
};

// Bit i: the node touches cell i of the 3 x 3 x 3; for all nodes of a cell cut into `factor`.
template <int factor>
constexpr std::array<std::uint32_t, (factor + 1) * (factor + 1) * (factor + 1)> touched() {
  constexpr int side = factor + 1;
  std::array<std::uint32_t, side * side * side> bits{};
  for (int n = 0; n < side * side * side; ++n)
    for (int i = 0; i < 27; ++i) {
      const int at[3] = {n % side, n / side % side, n / side / side};
      const int cell[3] = {i % 3, i / 3 % 3, i / 9};
      bool touches = true;
      for (int k = 0; k < 3; ++k)
        touches = touches && (cell[k] == 1 || at[k] == (cell[k] == 0 ? 0 : factor));
      bits[std::size_t(n)] |= std::uint32_t(touches) << i;
    }
  return bits;
}
constexpr auto kOfHalves = touched<2>();
constexpr auto kOfQuarters = touched<4>();

// The value at a fine node, 0 to 4 along each axis, of a cell with `factor` samples a voxel.
template <int factor>
float interpolated(const float* samples, const GridNode& at) {
  constexpr int step = 4 / factor, side = factor + 1;
  int low[3];
  float t[3];
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(at[k] / step, factor - 1);
    t[k] = float(at[k] - step * low[k]) / float(step);
  }
  float sum = 0;
  for (int c = 0; c < 8; ++c) {
    float weight = 1;
    for (int k = 0; k < 3; ++k) weight *= (c >> k & 1) != 0 ? t[k] : 1 - t[k];
    const int x = low[0] + (c & 1), y = low[1] + (c >> 1 & 1), z = low[2] + (c >> 2);
    sum += weight * samples[(z * side + y) * side + x];
  }
  return sum;
}

// Reads the field at fine nodes, by the cells around them.
class Cells {
 public:
  explicit Cells(const FieldData& field) : field_(field) {}

  Around around(const GridNode& middle, int own) const {
    Around out;
    for (int i = 0; i < 27; ++i) {
      if (i == 13) continue;
      Sampled& cell = out.cell[i];
      look_up({middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1}, cell);
      out.ones |= std::uint32_t(cell.factor == 1) << i;
      out.twos |= std::uint32_t(cell.factor == 2 && own == 4) << i;
    }
    return out;
  }

 private:
  // Without samples where there is no brick, or no whole cell at the band's end.
  void look_up(const GridNode& cell, Sampled& out) const {
    std::size_t brick = 0, local = 0;
    for (std::size_t k = 3; k-- > 0;) {
      if (cell[k] < 0 || cell[k] >= 8 * field_.bricks[k]) return;
      brick = brick * std::size_t(field_.bricks[k]) + std::size_t(cell[k] >> 3);
      local = local * 8 + std::size_t(cell[k] & 7);
    }
    const std::int32_t row = field_.brick_index[brick];
    if (row < 0) return;
    const std::int32_t refined = field_.refined[std::size_t(row)];
    const std::int32_t i = refined < 0 ? 0 : field_.fine_index[512 * std::size_t(refined) + local];
    if (i > 0) out.halves = &field_.halves[27 * std::size_t(i - 1)];
    if (i == 0 && !read_corners(cell, &field_.samples[512 * std::size_t(row) + local], out.corners))
      return;
    out.factor = i < 0 ? 4 : i > 0 ? 2 : 1;
  }

  // `first`: the sample at the cell's first node. Returns whether all eight are there.
  bool read_corners(const GridNode& cell, const float* first, float (&out)[8]) const {
    for (int c = 0; c < 8; ++c) {
      const GridNode at{cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)};
      bool beside = false;  // it lies in another brick
      for (std::size_t k = 0; k < 3; ++k) beside = beside || (at[k] >> 3) != (cell[k] >> 3);
      const float* const v = beside ? coarse_node(field_, {4 * at[0], 4 * at[1], 4 * at[2]})
                                    : first + (c & 1) + 8 * (c >> 1 & 1) + 64 * (c >> 2);
      if (v == nullptr) return false;
      out[c] = *v;
    }
    return true;
  }

  const FieldData& field_;
};

// All cells of `factor` in one refined brick, whose first node is `from`. A node takes the value
// that the coarsest cell that touches it has there.
void conform_brick(const Cells& cells, const GridNode& from, const std::int32_t* index, int factor,
                   FieldData& field) {
  const int side = factor + 1, step = 4 / factor;
  for (int c = 0; c < 512; ++c) {
    if (factor == 2 ? index[c] <= 0 : index[c] >= 0) continue;
    const GridNode cell{(from[0] >> 2) + c % 8, (from[1] >> 2) + c / 8 % 8,
                        (from[2] >> 2) + c / 64};
    const Around around = cells.around(cell, factor);
    if ((around.ones | around.twos) == 0) continue;
    float* values = factor == 2 ? &field.halves[27 * std::size_t(index[c] - 1)]
                                : &field.quarters[125 * std::size_t(-1 - index[c])];
    const std::uint32_t* const touches = factor == 2 ? kOfHalves.data() : kOfQuarters.data();
    for (int n = 0; n < side * side * side; ++n) {
      const std::uint32_t ones = touches[n] & around.ones, twos = touches[n] & around.twos;
      if ((ones | twos) == 0) continue;
      const int i = std::bit_width(ones != 0 ? ones : twos) - 1;
      const GridNode at{step * (n % side) - 4 * (i % 3 - 1),
                        step * (n / side % side) - 4 * (i / 3 % 3 - 1),
                        step * (n / side / side) - 4 * (i / 9 - 1)};
      values[n] = ones != 0 ? interpolated<1>(around.cell[i].corners, at)
                            : interpolated<2>(around.cell[i].halves, at);
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
