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

Cell cell_of(const h6FieldDef& def, std::size_t slot) {
  const std::size_t bx = def.bricks[0], by = def.bricks[1];
  return {{static_cast<std::int32_t>(slot % bx), static_cast<std::int32_t>(slot / bx % by),
           static_cast<std::int32_t>(slot / (bx * by))}};
}

std::size_t slot_count(const h6FieldDef& def) {
  return std::size_t(def.bricks[0]) * std::size_t(def.bricks[1]) * std::size_t(def.bricks[2]);
}

// Bounds at the corners of a far cell, in voxels, >= 0, and the side.
struct FarBound {
  double corner[8];
  double side;  // 1 outside the obstacle, -1 inside
};

FarBound far_bound(const h6FieldDef& def, const Cell& c) {
  FarBound bound{{}, 1.0};
  const std::size_t nx = def.bricks[0] + 1u, ny = def.bricks[1] + 1u;
  double L[8];
  bool inside = false, outside = false;
  for (int k = 0; k < 8; ++k) {
    const std::size_t x = c.at[0] + (k & 1), y = c.at[1] + (k >> 1 & 1), z = c.at[2] + (k >> 2);
    const double value = def.far_grid[(z * ny + y) * nx + x] / def.voxel_size;
    L[k] = std::max(std::fabs(value), def.band / def.voxel_size);
    inside |= value < 0;
    outside |= value > 0;
  }
  if (inside && outside) return bound;  // contradicts a far cell, so nothing is known: bound 0
  if (inside) bound.side = -1.0;
  std::copy_n(L, 8, bound.corner);
  return bound;
}

// To the nearest whole number, ties to even: a double of this size has no fraction. Compilers make
// vectors of it, where std::nearbyint is a call (model of 687,000 bricks: 0.8 s of CPU less).
std::int16_t round_near(double voxels, double quantum = kNearQuantum) {
  constexpr double kWhole = 0x1.8p52;
  const double q = std::clamp(voxels / quantum, -kInt16Max, kInt16Max);
  return static_cast<std::int16_t>(static_cast<std::int32_t>((q + kWhole) - kWhole));
}

std::int16_t round_far(double voxels) {
  const double q = std::floor((voxels - kFloatSlack) / kFarQuantum);
  return static_cast<std::int16_t>(std::clamp(q, 0.0, kInt16Max));
}

// The 9 x 9 x 9 nodes of a brick: its own 8 and one layer of up to 7 neighbours.
class BrickNodes {
 public:
  BrickNodes(const h6FieldDef& def, const Cell& brick) : def_(def) {
    for (int k = 0; k < 8; ++k) look_up(brick, k);
  }

  // The brick's own nodes (0..7, y, z) [m].
  const float* own(int y, int z) const { return source_[0].samples + (z * 8 + y) * 8; }
  // Node (x, y, z) of the brick, 0..8 each, in voxels.
  double at(int x, int y, int z) const {
    const int node[3] = {x, y, z};
    int local[3], neighbour = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const bool beyond = node[axis] == 8;
      // Past the last brick there is no node, and no sample reads one. Repeat the last node.
      local[axis] = !beyond ? node[axis] : in_grid_[axis] ? 0 : 7;
      if (beyond && in_grid_[axis]) neighbour |= 1 << axis;
    }
    return value(source_[neighbour], local);
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
      source_[k].bound = far_bound(def_, c);
    }
  }

  double value(const Source& source, const int n[3]) const {
    if (source.samples != nullptr) {
      return source.samples[(n[2] * 8 + n[1]) * 8 + n[0]] / def_.voxel_size;
    }
    double square = 0;
    for (int k = 0; k < 8; ++k) {
      double weight = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const double t = n[axis] / kEdge;
        weight *= (k >> axis & 1) != 0 ? t : 1 - t;
      }
      square += weight * source.bound.corner[k] * source.bound.corner[k];
    }
    for (int axis = 0; axis < 3; ++axis) square -= n[axis] * (kEdge - n[axis]);
    const double d = std::sqrt(std::max(square, 0.0));
    return source.bound.side * std::max(d, def_.band / def_.voxel_size);
  }

  const h6FieldDef& def_;
  Source source_[8] = {};
  bool in_grid_[3] = {};
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
  for (std::size_t slot = 0; slot < slot_count(def); ++slot) {
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

void layout_cell(const h6FieldDef& def, const std::int32_t* table, std::size_t slot,
                 std::int16_t* bricks, std::int16_t* far) {
  const Cell cell = cell_of(def, slot);
  const std::ptrdiff_t entry = table[slot];
  if (entry < 0) {
    const FarBound bound = far_bound(def, cell);
    std::int16_t* out = far + 8 * (-1 - entry);
    for (int k = 0; k < 8; ++k) {
      out[k] = static_cast<std::int16_t>(bound.side * round_far(bound.corner[k]));
    }
    return;
  }
  const BrickNodes nodes(def, cell);
  std::int16_t* out = bricks + kBrickStride * std::ptrdiff_t{row_of(table[slot])};
  for (int z = 0; z < 9; ++z) {
    for (int y = 0; y < 9; ++y) {
      if (y == 8 || z == 8) {
        for (int x = 0; x < 9; ++x) out[x] = round_near(nodes.at(x, y, z));
      } else {
        const float* own = nodes.own(y, z);
        for (int x = 0; x < 8; ++x) out[x] = round_near(own[x] / def.voxel_size);
        out[8] = round_near(nodes.at(8, y, z));
      }
      out += 9;
    }
  }
  std::fill_n(out, kBrickStride - kBrickNodes, std::int16_t{0});
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
    for (int n = 0; n < nodes; ++n)
      out[n] = round_near(from[n] / def.voxel_size, kNearQuantum / factor);
    std::fill_n(out + nodes, kFineUnit * units_of(cell) - nodes, std::int16_t{0});
  }
}

}  // namespace h6::kernels
