// SPDX-License-Identifier: Apache-2.0
// field_layout.cpp - from samples in metres to int16 nodes and far bounds in voxels.
//
// The bound of a far cell. Let D be the true unsigned distance, L_c <= D the far grid's magnitude
// at the cell's 8 corners, at least 0, H = 8 voxels its edge, and I(f) the trilinear interpolation
// of corner values, at a point x with fractions t along the axes.
//
// D^2 - |x|^2 is a minimum of linear functions of x, one for each point of the surface, so concave.
// Trilinear weights are positive, sum to 1 and reproduce x, so by Jensen
//     I(D^2) - I(|x|^2) <= D(x)^2 - |x|^2,
// and I(|x|^2) - |x|^2 = H^2 sum_a t_a (1 - t_a), hence
//     D(x)^2 >= I(L^2) - H^2 sum_a t_a (1 - t_a).
// Equality is possible, where the surface is a single point under a cell's middle. But a far cell
// lies outside the band: D(x) is at least the way to the cell's end plus the band. Let J(x) be the
// larger of the two bounds. D is 1-Lipschitz:
//     D(x) >= D(c) - |x - c| >= J(c) - |x - c|   for every c of the cell.
// At a flat surface the gap between J and D falls as 1 / D, so a c farther away is better, straight
// away from the surface, where D grows as |x - c|. The sampler follows the gradient of the squares
// to the cell's end; in another direction the bound would be loose, not wrong. Corners are rounded
// down by at least 1/1024 voxel, which lowers I by at least 2e-6 of itself: more than the sampler's
// own rounding.
#include "kernels/field/field_layout.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels/field/round_nodes.h"

namespace h6::kernels {
namespace {

constexpr double kEdge = 8.0;               // voxels a far cell
constexpr double kFloatSlack = 1.0 / 1024;  // voxels; see the end of the head comment
constexpr double kInt16Max = 32767.0;

struct Cell {
  std::int32_t at[3];
};

std::size_t slot_of(const h6FieldDef& def, const Cell& c) {
  return (static_cast<std::size_t>(c.at[2]) * def.bricks[1] + c.at[1]) * def.bricks[0] + c.at[0];
}

std::size_t slot_count(const h6FieldDef& def) {
  return std::size_t(def.bricks[0]) * std::size_t(def.bricks[1]) * std::size_t(def.bricks[2]);
}

// The bounds of the far grid at the four corners of one side of a cell, y fastest [voxel], and
// which signs they have.
struct FarSide {
  double least[4];
  bool inside = false, outside = false;
};

FarSide far_side(const h6FieldDef& def, std::int32_t x, std::int32_t y, std::int32_t z) {
  const std::size_t nx = def.bricks[0] + 1u, ny = def.bricks[1] + 1u;
  FarSide side;
  for (int k = 0; k < 4; ++k) {
    const std::size_t node = ((std::size_t(z) + (k >> 1)) * ny + y + (k & 1)) * nx + x;
    const double value = def.far_grid[node] / def.voxel_size;
    side.least[k] = std::max(std::fabs(value), def.band / def.voxel_size);
    side.inside |= value < 0;
    side.outside |= value > 0;
  }
  return side;
}

// Bounds at the corners of a far cell, in voxels, >= 0, and the side.
struct FarBound {
  double corner[8];
  int side;  // 1 outside the obstacle, -1 inside
};

FarBound far_bound(const FarSide& low, const FarSide& high) {
  FarBound bound{{}, 1};
  const bool inside = low.inside || high.inside;
  if (inside && (low.outside || high.outside))
    return bound;  // contradicts a far cell, so nothing is known: bound 0
  if (inside) bound.side = -1;
  for (int k = 0; k < 8; ++k) bound.corner[k] = ((k & 1) != 0 ? high : low).least[k >> 1];
  return bound;
}

FarBound far_bound(const h6FieldDef& def, const Cell& c) {
  const auto [x, y, z] = c.at;
  return far_bound(far_side(def, x, y, z), far_side(def, x + 1, y, z));
}

// Rounds down, since a far bound must not be too large.
std::int16_t round_far(double voxels) {
  const double q = std::clamp((voxels - kFloatSlack) / kFarQuantum, 0.0, kInt16Max);
  return static_cast<std::int16_t>(static_cast<std::int32_t>(q));
}

// kWeight[c][n]: what the lower (0) or upper corner of a cell weighs at its node n.
constexpr double kWeight[2][8] = {
    {1, 7 / kEdge, 6 / kEdge, 5 / kEdge, 4 / kEdge, 3 / kEdge, 2 / kEdge, 1 / kEdge},
    {0, 1 / kEdge, 2 / kEdge, 3 / kEdge, 4 / kEdge, 5 / kEdge, 6 / kEdge, 7 / kEdge}};

// The 9 x 9 x 9 nodes of a brick: its own 8 and one layer of up to 7 neighbours.
class BrickNodes {
 public:
  BrickNodes(const h6FieldDef& def, const Cell& brick) : def_(def) {
    for (int k = 0; k < 8; ++k) look_up(brick, k);
  }

  // Packs all nodes of the brick, and zeros behind them. Past the last brick there is no node, and
  // no sample reads one: the last node stands there again.
  void pack(std::int16_t* out) const {
    float metres[kBrickStride];
    std::fill_n(metres + kBrickNodes, kBrickStride - kBrickNodes, 0.0f);
    for_rows([&](const Source& source, const Source* beyond, int y, int z, std::size_t at) {
      const float* from = sample(source, y, z);
      std::memcpy(metres + at, from, 8 * sizeof *from);
      metres[at + 8] = beyond == nullptr ? from[7] : *sample(*beyond, y, z);
    });
    round_nodes(metres, def_.voxel_size, kNearQuantum, kBrickStride, out);
    if (!meets_far_) return;
    for_rows([&](const Source& source, const Source* beyond, int y, int z, std::size_t at) {
      if (source.samples == nullptr) {
        for (int x = 0; x < 8; ++x)
          out[at + x] = round_node(bound(source.bound, x, y, z), kNearQuantum);
        if (beyond == nullptr) out[at + 8] = out[at + 7];
      }
      if (beyond != nullptr && beyond->samples == nullptr)
        out[at + 8] = round_node(bound(beyond->bound, 0, y, z), kNearQuantum);
    });
  }

 private:
  struct Source {
    const float* samples;  // null: a far cell
    FarBound bound;
  };

  // Neighbour k lies one brick further along the axes whose bit is set in k.
  void look_up(const Cell& brick, int k) {
    Cell c = brick;
    for (int axis = 0; axis < 3; ++axis) {
      in_grid_[axis] = brick.at[axis] + 1 < def_.bricks[axis];
      if ((k >> axis & 1) != 0) ++c.at[axis];
      if (c.at[axis] >= def_.bricks[axis]) return;  // never read
    }
    const std::int32_t row = def_.brick_index[slot_of(def_, c)];
    if (row >= 0) {
      source_[k].samples = def_.samples + std::size_t{512} * row;
    } else {
      meets_far_ = true;
      source_[k].samples = nullptr;
      source_[k].bound = far_bound(def_, c);
    }
  }

  // Calls row(source, beyond, y, z, at) for the nodes (0..8, ...) from `at` on: the first eight are
  // nodes (0..7, y, z) of a source, the last one is (0, y, z) of the source beyond; null: none.
  template <class Row>
  void for_rows(const Row& row) const {
    std::size_t at = 0;
    for (int c = 0; c < 9; ++c)
      for (int b = 0; b < 9; ++b, at += 9) {
        const int source = (b == 8 && in_grid_[1] ? 2 : 0) | (c == 8 && in_grid_[2] ? 4 : 0);
        const int y = b < 8 ? b : in_grid_[1] ? 0 : 7, z = c < 8 ? c : in_grid_[2] ? 0 : 7;
        row(source_[source], in_grid_[0] ? &source_[source | 1] : nullptr, y, z, at);
      }
  }

  // Zeros of a far cell stand until its bounds are known.
  static const float* sample(const Source& source, int y, int z) {
    static constexpr float kZeros[8] = {};
    return source.samples == nullptr ? kZeros : source.samples + (z * 8 + y) * 8;
  }

  // A node of a far cell [voxel]. One of x, y and z is 0, so that at most four corners count.
  double bound(const FarBound& bound, int x, int y, int z) const {
    double square = 0;
    for (int k = 0; k < 8; ++k) {
      const double weight = kWeight[k & 1][x] * kWeight[k >> 1 & 1][y] * kWeight[k >> 2][z];
      if (weight != 0) square += weight * bound.corner[k] * bound.corner[k];
    }
    for (const int n : {x, y, z}) square -= n * (kEdge - n);
    const double d = std::sqrt(std::max(square, 0.0));
    return bound.side * std::max(d, def_.band / def_.voxel_size);
  }

  const h6FieldDef& def_;
  Source source_[8];
  bool in_grid_[3] = {}, meets_far_ = false;
};

// The entries of a brick in def.fine_index, one a cell; null where it is not refined.
const std::int32_t* finer_cells(const h6FieldDef& def, std::size_t slot) {
  const std::int32_t brick = def.brick_index[slot];
  const std::int32_t row = brick < 0 || def.refined == nullptr ? -1 : def.refined[brick];
  return row < 0 ? nullptr : def.fine_index + std::size_t{512} * row;
}

int units_of(std::int32_t cell) { return cell == 0 ? 0 : cell > 0 ? kHalfUnits : kQuarterUnits; }

}  // namespace

FieldLayoutSize field_layout_size(const h6FieldDef& def) {
  FieldLayoutSize size{0, 0, 0, 0};
  for (std::size_t slot = 0; slot < slot_count(def); ++slot) {
    ++(def.brick_index[slot] >= 0 ? size.bricks : size.far_cells);
    const std::int32_t* finer = finer_cells(def, slot);
    if (finer == nullptr) continue;
    ++size.refined;
    for (int c = 0; c < 512; ++c) size.fine_units += units_of(finer[c]);
  }
  return size;
}

float layout_band(const h6FieldDef& def) {
  return static_cast<float>(def.band / def.voxel_size * (1 - 1e-6));
}

void layout_table(const h6FieldDef& def, std::int32_t* table) {
  std::int32_t bricks = 0, far_cells = 0;
  for (std::size_t slot = 0; def.refined != nullptr && slot < slot_count(def); ++slot) {
    if (finer_cells(def, slot) != nullptr) table[slot] = kRefined | bricks++;
  }
  for (std::size_t slot = 0; slot < slot_count(def); ++slot) {
    if (finer_cells(def, slot) != nullptr) continue;
    table[slot] = def.brick_index[slot] >= 0 ? bricks++ : -1 - far_cells++;
  }
}

void layout_cuts(const h6FieldDef& def, const std::int32_t* table, std::uint16_t* cuts) {
  std::int32_t first = 0;
  for (std::size_t slot = 0; slot < slot_count(def); ++slot) {
    const std::int32_t* finer = finer_cells(def, slot);
    if (finer == nullptr) continue;
    std::uint16_t* out = cuts + std::ptrdiff_t{kCutStride} * row_of(table[slot]);
    std::fill_n(out, kCutHead, std::uint16_t{0});
    const std::int32_t before = first - 1;  // so that no code is 0
    std::memcpy(out, &before, sizeof before);
    std::int32_t at = 1;
    for (int c = 0; c < 512; ++c) {
      const int units = units_of(finer[c]);
      out[kCutHead + c] =
          units == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(2 * at + (finer[c] < 0));
      at += units;
    }
    first += at - 1;
  }
}

void layout_row(const h6FieldDef& def, const std::int32_t* table, std::size_t row,
                std::int16_t* bricks, std::int16_t* far) {
  const std::int32_t nx = def.bricks[0], y = static_cast<std::int32_t>(row % def.bricks[1]),
                     z = static_cast<std::int32_t>(row / def.bricks[1]);
  FarSide low, high = far_side(def, 0, y, z);
  for (std::int32_t x = 0; x < nx; ++x) {
    low = high;
    high = far_side(def, x + 1, y, z);
    const std::ptrdiff_t entry = table[row * nx + x];
    if (entry >= 0) {
      if (bricks == nullptr) continue;
      BrickNodes(def, {{x, y, z}})
          .pack(bricks + kBrickStride * std::ptrdiff_t{row_of(table[row * nx + x])});
      continue;
    }
    const FarBound bound = far_bound(low, high);
    std::int16_t* out = far + 8 * (-1 - entry);
    for (int k = 0; k < 8; ++k)
      out[k] = static_cast<std::int16_t>(bound.side * round_far(bound.corner[k]));
  }
}

void layout_fine(const h6FieldDef& def, const std::int32_t* table, const std::uint16_t* cuts,
                 std::size_t slot, std::int16_t* fine) {
  const std::int32_t* finer = finer_cells(def, slot);
  if (finer == nullptr) return;
  const std::uint16_t* codes = cuts + std::ptrdiff_t{kCutStride} * row_of(table[slot]);
  std::int32_t first;
  std::memcpy(&first, codes, sizeof first);
  for (int c = 0; c < 512; ++c) {
    const std::int32_t cell = finer[c];
    if (cell == 0) continue;
    const int factor = cell > 0 ? 2 : 4, nodes = cell > 0 ? 27 : 125;
    const float* from = cell > 0 ? def.halves + std::ptrdiff_t{27} * (cell - 1)
                                 : def.quarters + std::ptrdiff_t{125} * (-1 - cell);
    std::int16_t* out = fine + std::ptrdiff_t{kFineUnit} * (first + (codes[kCutHead + c] >> 1));
    round_nodes(from, def.voxel_size, kNearQuantum / factor, static_cast<std::size_t>(nodes), out);
    std::fill_n(out + nodes, kFineUnit * units_of(cell) - nodes, std::int16_t{0});
  }
}

}  // namespace h6::kernels
