// SPDX-License-Identifier: Apache-2.0
// grids.cpp - fields to and from grids: all but the samples.
#include "io/field/grids.h"

#include <cmath>
#include <exception>
#include <limits>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

using openvdb::FloatGrid;
using openvdb::Int32Grid;

std::string key(const char* name) { return std::string("hapsix_") + name; }

// How many of the file's units make a metre: 1, unless voxels are so small that OpenVDB takes their
// volume for zero (it refuses transforms below 3e-15). hapsix_units_per_metre says so in the file;
// our own size and place come from metadata in metres.
double units_per_metre(const FieldData& field) {
  double units = 1;
  while (field.voxel_size * units < 2e-5) units *= 1000;
  return units;
}

openvdb::math::Transform::Ptr make_transform(const FieldData& field, double spacing) {
  const double u = units_per_metre(field);
  auto transform = openvdb::math::Transform::createLinearTransform(u * spacing);
  transform->postTranslate(
      openvdb::Vec3d(u * field.origin.x, u * field.origin.y, u * field.origin.z));
  return transform;
}

Place nodes_of(const FieldData& f) { return {{f.bricks[0] + 1, f.bricks[1] + 1, f.bricks[2] + 1}}; }

FloatGrid::Ptr far_grid(const FieldData& field) {
  auto grid = FloatGrid::create(float(field.band));
  grid->setName("far");
  grid->setTransform(make_transform(field, 8 * field.voxel_size));
  const Place nodes = nodes_of(field);
  auto access = grid->getAccessor();
  for (std::size_t i = 0; i < field.far_grid.size(); ++i) {
    const auto at = nodes.at(i);
    access.setValueOn(openvdb::Coord(at[0], at[1], at[2]), field.far_grid[i]);
  }
  return grid;
}

// One voxel a brick.
Int32Grid::Ptr brick_grid(const FieldData& field, const char* name,
                          const std::vector<std::int32_t>& value) {
  auto grid = Int32Grid::create(-1);
  grid->setName(name);
  grid->setTransform(make_transform(field, 8 * field.voxel_size));
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

// Three things at once; an exception of one of them comes out here.
template <class Body>
void three_at_once(const Body& body) {
  std::exception_ptr thrown[3];
  sched::parallel_for(3, 0, [&](std::size_t i) {
    try {
      body(i);
    } catch (...) {
      thrown[i] = std::current_exception();
    }
  });
  for (const std::exception_ptr& e : thrown)
    if (e) std::rethrow_exception(e);
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

// Values of all bricks, each in low..high.
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

}  // namespace

FloatGrid::Ptr bare_distance_grid(const FieldData& field) {
  auto grid = FloatGrid::create(float(field.band));
  grid->setName("distance");
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(make_transform(field, field.voxel_size));
  grid->insertMeta(key("format"), openvdb::Int32Metadata(kFieldFormat));
  grid->insertMeta(key("bricks"), openvdb::Vec3IMetadata(openvdb::Vec3i(field.bricks.data())));
  grid->insertMeta(key("origin"), openvdb::Vec3DMetadata(openvdb::Vec3d(
                                      field.origin.x, field.origin.y, field.origin.z)));
  grid->insertMeta(key("voxel_size"), openvdb::DoubleMetadata(field.voxel_size));
  grid->insertMeta(key("band"), openvdb::DoubleMetadata(field.band));
  grid->insertMeta(key("offset"), openvdb::DoubleMetadata(field.offset));
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

openvdb::GridPtrVec small_grids(const FieldData& field) {
  openvdb::GridPtrVec grids(3);
  three_at_once([&](std::size_t i) {
    if (i == 0) grids[0] = far_grid(field);
    if (i == 1 && !field.part.empty()) grids[1] = brick_grid(field, "part", field.part);
    if (i == 2 && !field.triangle.empty()) grids[2] = brick_grid(field, "triangle", field.triangle);
  });
  std::erase(grids, nullptr);
  return grids;
}

bool take_head(const FloatGrid& grid, FieldData& f) {
  openvdb::Vec3i bricks;
  openvdb::Vec3d origin;
  openvdb::Int64 triangles = 0;
  std::int32_t format = 0, parts = 0;
  const bool whole = take(grid, "format", format) && format == kFieldFormat &&
                     take(grid, "bricks", bricks) && take(grid, "origin", origin) &&
                     take(grid, "voxel_size", f.voxel_size) && take(grid, "band", f.band) &&
                     take(grid, "offset", f.offset) && take(grid, "sign_mode", f.sign_mode) &&
                     take(grid, "input_hash", f.input_hash) && take(grid, "triangles", triangles) &&
                     triangles >= 0 && take(grid, "parts", parts) && parts >= 0;
  if (!whole) return false;
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

bool take_small(const openvdb::GridPtrVec& grids, FieldData& f) {
  const auto far = find<FloatGrid>(grids, "far");
  if (!far) return false;
  const auto part = find<Int32Grid>(grids, "part"), triangle = find<Int32Grid>(grids, "triangle");
  const std::int64_t any = std::numeric_limits<std::int32_t>::max();
  const std::int64_t parts = f.part_names.empty() ? any : std::int64_t(f.part_names.size()) - 1;
  bool good[3] = {};
  three_at_once([&](std::size_t i) {
    if (i == 0) good[0] = take_far(*far, f);
    if (i == 1) good[1] = take_bricks(part.get(), f, 0, parts, f.part);
    if (i == 2)
      good[2] = take_bricks(triangle.get(), f, -1, std::int64_t(f.triangles) - 1, f.triangle);
  });
  return good[0] && good[1] && good[2];
}

FloatGrid::Ptr own_distance(const openvdb::GridPtrVec& grids) {
  const auto distance = find<FloatGrid>(grids, "distance");
  return distance && distance->getMetadata<openvdb::Int32Metadata>(key("format")) ? distance
                                                                                  : nullptr;
}

}  // namespace h6::io
