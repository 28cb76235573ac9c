// SPDX-License-Identifier: Apache-2.0
// fine_grids.cpp - the finer samples of a field to and from grids:
//
//   cut         FloatGrid, one voxel for a cell with finer samples: 2 or 4 of them a voxel
//   distance_2  FloatGrid, level set [m], node spacing half a voxel: the nodes of cells cut into 2
//   distance_4  FloatGrid, level set [m], a quarter of a voxel: the nodes of cells cut into 4
//
// Cells of one kind share the nodes between them, so a field keeps its samples only if these agree
// there, as bake_field makes them.
#include <openvdb/openvdb.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "io/field/grids.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;

constexpr const char* kCutName = "cut";

// Calls f(first node of the brick, its entries in fine_index) for each refined brick.
template <class F>
void each_refined(const FieldData& field, F&& f) {
  const Place cells{field.bricks};
  for (std::size_t c = 0; c < field.brick_index.size() && !field.refined.empty(); ++c) {
    const std::int32_t row = field.brick_index[c];
    const std::int32_t refined = row < 0 ? -1 : field.refined[std::size_t(row)];
    if (refined < 0) continue;
    const auto at = cells.at(c);
    f(Coord(8 * at[0], 8 * at[1], 8 * at[2]), &field.fine_index[512 * std::size_t(refined)]);
  }
}

Coord cell_in(const Coord& brick, int c) { return brick + Coord(c % 8, c / 8 % 8, c / 64); }

// Calls f(node, sample) for the (factor + 1)^3 nodes of a cell.
template <class Sample, class F>
void each_node(const Coord& cell, int factor, Sample* samples, F&& f) {
  const int side = factor + 1;
  for (int n = 0; n < side * side * side; ++n)
    f(Coord(factor * cell[0] + n % side, factor * cell[1] + n / side % side,
            factor * cell[2] + n / side / side),
      samples[n]);
}

FloatGrid::Ptr level_grid(const FieldData& field, int factor) {
  auto grid = FloatGrid::create(float(field.band));
  grid->setName("distance_" + std::to_string(factor));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(transform_of(field, field.voxel_size / factor));
  auto access = grid->getAccessor();
  each_refined(field, [&](const Coord& brick, const std::int32_t* index) {
    for (int c = 0; c < 512; ++c) {
      if (factor == 2 ? index[c] <= 0 : index[c] >= 0) continue;
      const float* samples = factor == 2 ? &field.halves[27 * std::size_t(index[c] - 1)]
                                         : &field.quarters[125 * std::size_t(-1 - index[c])];
      each_node(cell_in(brick, c), factor, samples,
                [&](const Coord& node, float v) { access.setValueOn(node, v); });
    }
  });
  return grid;
}

const FloatGrid* named(const openvdb::GridPtrVec& grids, const std::string& name) {
  for (const auto& grid : grids)
    if (grid && grid->getName() == name) return dynamic_cast<const FloatGrid*>(grid.get());
  return nullptr;
}

// refined and fine_index, and room for the samples.
bool take_cut(const FloatGrid& cut, FieldData& f) {
  const Place cells{f.bricks};
  std::vector<std::vector<std::pair<std::uint16_t, bool>>> found(f.brick_count());  // half?
  for (auto v = cut.cbeginValueOn(); v; ++v) {
    const Coord at = v.getCoord();
    for (int k = 0; k < 3; ++k)
      if (at[k] < 0 || at[k] >= 8 * f.bricks[std::size_t(k)]) return false;
    const std::int32_t row = f.brick_index[cells.index(at[0] / 8, at[1] / 8, at[2] / 8)];
    if (!v.isVoxelValue() || row < 0 || (*v != 2 && *v != 4)) return false;
    found[std::size_t(row)].push_back(
        {std::uint16_t((at[2] % 8 * 8 + at[1] % 8) * 8 + at[0] % 8), *v == 2});
  }
  std::int32_t halves = 0, quarters = 0;
  f.refined.assign(f.brick_count(), -1);
  for (std::size_t row = 0; row < found.size(); ++row) {
    if (found[row].empty()) continue;
    f.refined[row] = std::int32_t(f.fine_index.size() / 512);
    f.fine_index.resize(f.fine_index.size() + 512);
    std::sort(found[row].begin(), found[row].end());
    for (const auto& [c, half] : found[row])
      f.fine_index[f.fine_index.size() - 512 + c] = half ? ++halves : -++quarters;
  }
  f.halves.resize(27 * std::size_t(halves));
  f.quarters.resize(125 * std::size_t(quarters));
  return true;
}

}  // namespace

void add_fine_grids(const FieldData& field, openvdb::GridPtrVec& grids) {
  if (field.refined.empty()) return;
  auto cut = FloatGrid::create(1.0f);
  cut->setName(kCutName);
  cut->setTransform(transform_of(field, field.voxel_size));
  auto access = cut->getAccessor();
  each_refined(field, [&](const Coord& brick, const std::int32_t* index) {
    for (int c = 0; c < 512; ++c)
      if (index[c] != 0) access.setValueOn(cell_in(brick, c), index[c] > 0 ? 2.0f : 4.0f);
  });
  grids.push_back(cut);
  for (const int factor : {2, 4}) grids.push_back(level_grid(field, factor));
}

bool take_fine_grids(const openvdb::GridPtrVec& grids, FieldData& field) {
  const FloatGrid* cut = named(grids, kCutName);
  if (cut == nullptr) return true;
  const FloatGrid* level[2] = {named(grids, "distance_2"), named(grids, "distance_4")};
  if (level[0] == nullptr || level[1] == nullptr || !take_cut(*cut, field)) return false;
  std::vector<std::pair<Coord, const std::int32_t*>> bricks;
  each_refined(field, [&](const Coord& brick, const std::int32_t* index) {
    bricks.emplace_back(brick, index);
  });
  std::atomic<bool> whole{true};
  sched::parallel_for(bricks.size(), 0, [&](std::size_t b) {
    const auto& [brick, index] = bricks[b];
    const FloatGrid::ConstAccessor access[2] = {level[0]->getConstAccessor(),
                                                level[1]->getConstAccessor()};
    bool good = true;
    for (int c = 0; c < 512; ++c) {
      if (index[c] == 0) continue;
      const bool half = index[c] > 0;
      float* samples = half ? &field.halves[27 * std::size_t(index[c] - 1)]
                            : &field.quarters[125 * std::size_t(-1 - index[c])];
      each_node(cell_in(brick, c), half ? 2 : 4, samples, [&](const Coord& node, float& v) {
        good &= access[half ? 0 : 1].probeValue(node, v) && std::isfinite(v);
      });
    }
    if (!good) whole = false;
  });
  return whole;
}

}  // namespace h6::io
