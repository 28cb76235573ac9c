// SPDX-License-Identifier: Apache-2.0
// grids.cpp - fields of hapsix to and from grids:
//
//   distance  FloatGrid, level set [m]; a leaf of 8^3 voxels is a brick, all of it active
//   far       FloatGrid, one voxel for every 8: the far grid, as it stands
//   part      Int32Grid, one voxel for a brick; only where the mesh has parts
//   triangle  Int32Grid, one voxel for a brick; -1 where a sealed hole is nearest
//
// and, where cells have finer samples, the grids of fine_grids.cpp.
//
// The rest of FieldData is metadata of `distance`, named hapsix_*. Leaves run z fastest, bricks x.
#include "io/field/grids.h"

#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

using openvdb::FloatGrid;
using openvdb::Int32Grid;
using FloatLeaf = FloatGrid::TreeType::LeafNodeType;
using Leaves = std::vector<FloatLeaf*>;

std::string key(const char* name) { return std::string("hapsix_") + name; }

// How many of the file's units make a metre: 1, unless voxels are so small that OpenVDB takes their
// volume for zero (it refuses transforms below 3e-15). hapsix_units_per_metre tells other programs;
// we read size and place from metadata in metres.
double units_per_metre(const FieldData& field) {
  double units = 1;
  while (field.voxel_size * units < 2e-5) units *= 1000;
  return units;
}

Place nodes_of(const FieldData& f) { return {{f.bricks[0] + 1, f.bricks[1] + 1, f.bricks[2] + 1}}; }

FloatGrid::Ptr far_grid(const FieldData& field) {
  auto grid = FloatGrid::create(float(field.band));
  grid->setName("far");
  grid->setTransform(transform_of(field, 8 * field.voxel_size));
  const Place nodes = nodes_of(field);
  auto access = grid->getAccessor();
  for (std::size_t i = 0; i < field.far_grid.size(); ++i) {
    const auto at = nodes.at(i);
    access.setValueOn(openvdb::Coord(at[0], at[1], at[2]), field.far_grid[i]);
  }
  return grid;
}

// A grid with one voxel for each brick.
Int32Grid::Ptr brick_grid(const FieldData& field, const char* name,
                          const std::vector<std::int32_t>& value) {
  auto grid = Int32Grid::create(-1);
  grid->setName(name);
  grid->setTransform(transform_of(field, 8 * field.voxel_size));
  const Place cells{field.bricks};
  auto access = grid->getAccessor();
  for (std::size_t c = 0; c < field.brick_index.size(); ++c) {
    if (field.brick_index[c] < 0) continue;
    const auto at = cells.at(c);
    access.setValueOn(openvdb::Coord(at[0], at[1], at[2]),
                      value[std::size_t(field.brick_index[c])]);
  }
  return grid;
}

// `distance` with its metadata and without leaves.
FloatGrid::Ptr empty_distance_grid(const FieldData& field) {
  auto grid = FloatGrid::create(float(field.band));
  grid->setName("distance");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(transform_of(field, field.voxel_size));
  grid->insertMeta(key("format"),
                   openvdb::Int32Metadata(field.refined.empty() ? kFieldFormat : kRefinedFormat));
  grid->insertMeta(key("bricks"), openvdb::Vec3IMetadata(openvdb::Vec3i(field.bricks.data())));
  grid->insertMeta(key("origin"), openvdb::Vec3DMetadata(openvdb::Vec3d(
                                      field.origin.x, field.origin.y, field.origin.z)));
  grid->insertMeta(key("voxel_size"), openvdb::DoubleMetadata(field.voxel_size));
  grid->insertMeta(key("band"), openvdb::DoubleMetadata(field.band));
  grid->insertMeta(key("offset"), openvdb::DoubleMetadata(field.offset));
  if (field.tolerance > 0)
    grid->insertMeta(key("tolerance"), openvdb::DoubleMetadata(field.tolerance));
  if (field.grown > 0) grid->insertMeta(key("grown"), openvdb::DoubleMetadata(field.grown));
  grid->insertMeta(key("sign_mode"), openvdb::StringMetadata(field.sign_mode));
  grid->insertMeta(key("units_per_metre"), openvdb::DoubleMetadata(units_per_metre(field)));
  grid->insertMeta(key("input_hash"), openvdb::StringMetadata(field.input_hash));
  grid->insertMeta(key("triangles"),
                   openvdb::Int64Metadata(static_cast<openvdb::Int64>(field.triangles)));
  grid->insertMeta(key("parts"), openvdb::Int32Metadata(std::int32_t(field.part_names.size())));
  for (std::size_t i = 0; i < field.part_names.size(); ++i)
    grid->insertMeta(key("part_") + std::to_string(i),
                     openvdb::StringMetadata(field.part_names[i]));
  return grid;
}

void samples_to_leaf(const float* samples, FloatLeaf& leaf) {
  float* out = leaf.buffer().data();
  for (std::size_t z = 0; z < 8; ++z)
    for (std::size_t y = 0; y < 8; ++y)
      for (std::size_t x = 0; x < 8; ++x) out[x * 64 + y * 8 + z] = samples[z * 64 + y * 8 + x];
}

FloatGrid::Ptr distance_grid(const FieldData& field) {
  const FloatGrid::Ptr grid = empty_distance_grid(field);
  const Place cells{field.bricks};
  std::vector<std::size_t> used;
  for (std::size_t c = 0; c < field.brick_index.size(); ++c)
    if (field.brick_index[c] >= 0) used.push_back(c);
  Leaves leaves(used.size());
  sched::parallel_for(used.size(), 0, [&](std::size_t i) {
    const auto at = cells.at(used[i]);
    leaves[i] = new FloatLeaf(openvdb::Coord(8 * at[0], 8 * at[1], 8 * at[2]), 0.0f, true);
    samples_to_leaf(&field.samples[std::size_t(field.brick_index[used[i]]) * 512], *leaves[i]);
  });
  for (FloatLeaf* leaf : leaves) grid->tree().addLeaf(leaf);
  // Lets other programs see the inside of a solid as inside. No leaf changes, because all are
  // active.
  openvdb::tools::signedFloodFill(grid->tree());
  return grid;
}

template <class T>
bool take(const openvdb::GridBase& grid, const char* name, T& value) {
  const auto meta = grid.getMetadata<openvdb::TypedMetadata<T>>(key(name));
  if (!meta) return false;
  value = meta->value();
  return true;
}

template <class Grid>
typename Grid::Ptr find(const openvdb::GridPtrVec& grids, const char* name) {
  for (const auto& grid : grids)
    if (grid && grid->getName() == name)
      if (auto typed = openvdb::gridPtrCast<Grid>(grid)) return typed;
  return nullptr;
}

bool take_far(const FloatGrid& grid, FieldData& f) {
  const Place nodes = nodes_of(f);
  f.far_grid.resize(nodes.count());
  const auto access = grid.getConstAccessor();
  for (std::size_t i = 0; i < f.far_grid.size(); ++i) {
    const auto at = nodes.at(i);
    if (!access.probeValue(openvdb::Coord(at[0], at[1], at[2]), f.far_grid[i])) return false;
    if (!std::isfinite(f.far_grid[i])) return false;
  }
  return true;
}

// The values of all bricks; false unless each is in low..high.
bool take_bricks(const Int32Grid* grid, const FieldData& f, std::int64_t low, std::int64_t high,
                 std::vector<std::int32_t>& value) {
  if (grid == nullptr) return true;
  const Place cells{f.bricks};
  const auto access = grid->getConstAccessor();
  value.resize(f.brick_count());
  for (std::size_t c = 0; c < f.brick_index.size(); ++c) {
    if (f.brick_index[c] < 0) continue;
    const auto at = cells.at(c);
    std::int32_t& v = value[std::size_t(f.brick_index[c])];
    if (!access.probeValue(openvdb::Coord(at[0], at[1], at[2]), v)) return false;
    if (v < low || v > high) return false;
  }
  return true;
}

// False where a value is not finite.
bool leaf_to_samples(const FloatLeaf& leaf, float* samples) {
  const float* in = leaf.buffer().data();
  bool finite = true;
  for (std::size_t z = 0; z < 8; ++z)
    for (std::size_t y = 0; y < 8; ++y)
      for (std::size_t x = 0; x < 8; ++x) {
        const float v = in[x * 64 + y * 8 + z];
        finite &= std::isfinite(v);
        samples[z * 64 + y * 8 + x] = v;
      }
  return finite;
}

bool take_head(const FloatGrid& grid, FieldData& f) {
  openvdb::Vec3i bricks;
  openvdb::Vec3d origin;
  openvdb::Int64 triangles = 0;
  std::int32_t format = 0, parts = 0;
  const bool whole = take(grid, "format", format) && reads_format(format) &&
                     take(grid, "bricks", bricks) && take(grid, "origin", origin) &&
                     take(grid, "voxel_size", f.voxel_size) && take(grid, "band", f.band) &&
                     take(grid, "offset", f.offset) && take(grid, "sign_mode", f.sign_mode) &&
                     take(grid, "input_hash", f.input_hash) && take(grid, "triangles", triangles) &&
                     triangles >= 0 && take(grid, "parts", parts) && parts >= 0;
  if (!whole) return false;
  for (const auto& [name, length] : {std::pair{"tolerance", &f.tolerance}, {"grown", &f.grown}})
    if (take(grid, name, *length) && !(*length > 0 && std::isfinite(*length))) return false;
  f.triangles = std::size_t(triangles);
  f.origin = {origin.x(), origin.y(), origin.z()};
  for (std::size_t k = 0; k < 3; ++k) {
    f.bricks[k] = bricks[int(k)];
    if (f.bricks[k] < 1 || f.bricks[k] > kMaxBricksOnSide) return false;
  }
  for (std::int32_t i = 0; i < parts; ++i) {
    std::string name;
    const std::string at = "part_" + std::to_string(i);
    if (!take(grid, at.c_str(), name)) return false;
    f.part_names.push_back(name);
  }
  return std::isfinite(origin.x() + origin.y() + origin.z()) && std::isfinite(f.voxel_size) &&
         f.voxel_size > 0 && std::isfinite(f.band) && f.band > 0 && std::isfinite(f.offset);
}

bool take_leaves(FloatGrid& grid, FieldData& f) {
  const Place cells{f.bricks};
  f.brick_index.assign(cells.count(), -1);
  Leaves leaves;
  grid.tree().getNodes(leaves);
  std::vector<FloatLeaf*> leaf_of(cells.count(), nullptr);
  for (FloatLeaf* leaf : leaves) {
    const openvdb::Coord o = leaf->origin();
    for (int k = 0; k < 3; ++k)
      if (o[k] < 0 || o[k] >= 8 * f.bricks[std::size_t(k)]) return false;
    leaf_of[cells.index(o[0] / 8, o[1] / 8, o[2] / 8)] = leaf;
  }
  std::vector<const FloatLeaf*> rows;
  for (std::size_t c = 0; c < leaf_of.size(); ++c) {
    if (leaf_of[c] == nullptr) continue;
    f.brick_index[c] = std::int32_t(rows.size());
    rows.push_back(leaf_of[c]);
  }
  f.samples.resize(rows.size() * 512);
  std::vector<std::uint8_t> finite(rows.size());
  sched::parallel_for(rows.size(), 0, [&](std::size_t r) {
    finite[r] = leaf_to_samples(*rows[r], &f.samples[r * 512]);
  });
  return std::find(finite.begin(), finite.end(), 0) == finite.end();
}

FloatGrid::Ptr own_distance(const openvdb::GridPtrVec& grids) {
  const auto distance = find<FloatGrid>(grids, "distance");
  return distance && distance->getMetadata<openvdb::Int32Metadata>(key("format")) ? distance
                                                                                  : nullptr;
}

}  // namespace

openvdb::math::Transform::Ptr transform_of(const FieldData& field, double spacing) {
  const double u = units_per_metre(field);
  auto transform = openvdb::math::Transform::createLinearTransform(u * spacing);
  transform->postTranslate(
      openvdb::Vec3d(u * field.origin.x, u * field.origin.y, u * field.origin.z));
  return transform;
}

openvdb::GridPtrVec grids_of(const FieldData& field) {
  openvdb::GridPtrVec grids{distance_grid(field), far_grid(field)};
  if (!field.part.empty()) grids.push_back(brick_grid(field, "part", field.part));
  if (!field.triangle.empty()) grids.push_back(brick_grid(field, "triangle", field.triangle));
  add_fine_grids(field, grids);
  return grids;
}

bool are_ours(const openvdb::GridPtrVec& grids) { return own_distance(grids) != nullptr; }

std::optional<FieldData> field_of(const openvdb::GridPtrVec& grids) {
  const auto distance = own_distance(grids);
  const auto far = find<FloatGrid>(grids, "far");
  const auto part = find<Int32Grid>(grids, "part"), triangle = find<Int32Grid>(grids, "triangle");
  FieldData f;
  if (!distance || !far || !take_head(*distance, f) || !take_leaves(*distance, f)) return {};
  const std::int64_t any = std::numeric_limits<std::int32_t>::max();
  const std::int64_t parts = f.part_names.empty() ? any : std::int64_t(f.part_names.size()) - 1;
  if (!take_far(*far, f) || !take_bricks(part.get(), f, 0, parts, f.part) ||
      !take_bricks(triangle.get(), f, -1, std::int64_t(f.triangles) - 1, f.triangle) ||
      !take_fine_grids(grids, f))
    return {};
  return f;
}

}  // namespace h6::io
