// SPDX-License-Identifier: Apache-2.0
// foreign.cpp - a field from a narrow-band level set of another program.
//
// Its values are distances where they are below the background, the half width of its band. In a
// band of at least 3 voxels, values that rise faster than distances can are lowered, and the nodes
// beyond get safe distances (extend_band.h): then the band of our field is as wide. Otherwise it is
// sqrt(3) voxels narrower, since all cells there have the level set's own values at all nodes.
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>

#include "io/field/extend_band.h"
#include "io/field/grids.h"
#include "io/field/lipschitz.h"
#include "io/field/nearest_node.h"

namespace h6::io {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using FloatLeaf = FloatGrid::TreeType::LeafNodeType;

FloatGrid::Ptr only_level_set(const openvdb::GridPtrVec& grids) {
  FloatGrid::Ptr found, any;
  std::size_t level_sets = 0, floats = 0;
  for (const auto& grid : grids) {
    const auto typed = grid ? openvdb::gridPtrCast<FloatGrid>(grid) : nullptr;
    if (!typed) continue;
    ++floats;
    any = typed;
    if (typed->getGridClass() != openvdb::GRID_LEVEL_SET) continue;
    ++level_sets;
    found = typed;
  }
  if (level_sets == 1) return found;
  return floats == 1 && any->getGridClass() == openvdb::GRID_UNKNOWN ? any : nullptr;
}

struct Frame {
  Coord low;  // first voxel of brick (0,0,0)
  double voxel = 0;
  float background = 0;
};

bool straight(const openvdb::math::Transform& t, double& voxel) {
  const openvdb::Vec3d o = t.indexToWorld(openvdb::Vec3d(0, 0, 0));
  voxel = t.indexToWorld(openvdb::Vec3d(1, 0, 0)).x() - o.x();
  if (!t.isLinear() || !std::isfinite(voxel) || !(voxel > 0)) return false;
  for (int k = 0; k < 3; ++k) {
    openvdb::Vec3d e(0, 0, 0);
    e[k] = 1;
    const openvdb::Vec3d step = t.indexToWorld(e) - o;
    for (int j = 0; j < 3; ++j)
      if (std::fabs(step[j] - (j == k ? voxel : 0.0)) > 1e-6 * voxel) return false;
    if (!std::isfinite(o[k])) return false;
  }
  return true;
}

// A point of the surface lies within half a diagonal of a node that is no farther from it.
void far_bounds(FloatGrid& grid, const Frame& frame, FieldData& f) {
  const double half_diagonal = 0.8661 * frame.voxel;
  const std::vector<float> squared = squared_to_nearest(f, half_diagonal, 0);
  const auto access = grid.getConstAccessor();
  const std::array<std::int32_t, 3> size{f.bricks[0] + 1, f.bricks[1] + 1, f.bricks[2] + 1};
  const Place nodes{size};
  f.far_grid.resize(nodes.count());
  for (std::size_t i = 0; i < f.far_grid.size(); ++i) {
    const auto at = nodes.at(i);
    const float v = access.getValue(frame.low + Coord(8 * at[0], 8 * at[1], 8 * at[2]));
    const double known = std::min(std::fabs(v), frame.background);
    const double nearest = std::isfinite(squared[i]) ? std::sqrt(double(squared[i])) : 0;
    const double bound = nearest * frame.voxel - half_diagonal;
    f.far_grid[i] =
        std::copysign(float(known < frame.background ? known : std::max(known, bound)), v);
  }
}

// The short form of culling wants 3 voxels, and neighbours that differ by at most one
// (kernels/contact/cull_spheres.h).
void widen(const FloatGrid& grid, const Frame& frame, FieldData& f) {
  if (frame.background < 2.999 * frame.voxel) return;
  lower_steep_samples(f);
  const Place cells{f.bricks};
  const auto inside = [&](std::size_t cell) {
    const auto at = cells.at(cell);
    return grid.tree().getValue(frame.low + Coord(8 * at[0], 8 * at[1], 8 * at[2])) < 0;
  };
  extend_band(f, frame.background, inside, 0);
  // It is steep still where the level set was cut off.
  if (steepest_edge(f, frame.background, 0) <= 1 + kSteepSlack) f.band = frame.background;
}

}  // namespace

Result<FieldData> foreign_field(const openvdb::GridPtrVec& grids, const std::string& name) {
  const FloatGrid::Ptr grid = only_level_set(grids);
  if (!grid) return Failure{name + " must hold one float level set grid to be taken as a field"};
  Frame frame;
  if (!straight(grid->transform(), frame.voxel))
    return Failure{name + " has stretched or turned voxels: resample it to cubes along the axes"};
  frame.background = std::fabs(grid->background());
  const double band = frame.background - 1.7321 * frame.voxel;
  if (!std::isfinite(frame.background) || !(band >= 0.5 * frame.voxel))
    return Failure{name + " has too narrow a band: at least 3 voxels on each side are needed"};

  std::vector<FloatLeaf*> leaves;
  grid->tree().getNodes(leaves);
  Coord low = Coord::max(), high = Coord::min();
  for (const FloatLeaf* leaf : leaves) {
    low.minComponent(leaf->origin());
    high.maxComponent(leaf->origin());
  }
  if (leaves.empty()) return Failure{name + " is an empty level set: there is no surface in it"};
  FieldData f;
  // One empty brick all around puts the border outside.
  for (int k = 0; k < 3; ++k) {
    const std::int64_t bricks = (std::int64_t(high[k]) - low[k]) / 8 + 3;
    if (bricks > kMaxBricksOnSide || std::abs(std::int64_t(low[k])) > (1 << 30))
      return Failure{name + " is larger than 2048 voxels on a side: resample it"};
    f.bricks[std::size_t(k)] = std::int32_t(bricks);
  }
  frame.low = low - Coord(8);
  openvdb::tools::signedFloodFill(grid->tree());
  const openvdb::Vec3d origin = grid->indexToWorld(frame.low);
  f.origin = {origin.x(), origin.y(), origin.z()};
  f.voxel_size = frame.voxel;
  f.band = band;
  f.sign_mode = "given";

  const std::size_t nx = std::size_t(f.bricks[0]), ny = std::size_t(f.bricks[1]);
  const std::size_t cells = nx * ny * std::size_t(f.bricks[2]);
  std::vector<const FloatLeaf*> leaf_of(cells, nullptr);
  for (const FloatLeaf* leaf : leaves) {
    const Coord at = leaf->origin() - frame.low;
    leaf_of[(std::size_t(at[2] / 8) * ny + std::size_t(at[1] / 8)) * nx + std::size_t(at[0] / 8)] =
        leaf;
  }
  f.brick_index.assign(cells, -1);
  std::size_t pairs = 0, steep = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    if (leaf_of[c] == nullptr) continue;
    f.brick_index[c] = std::int32_t(f.brick_count());
    const float* in = leaf_of[c]->buffer().data();
    for (std::size_t n = 0; n < 512; ++n) {
      const float v = in[(n % 8) * 64 + n / 8 % 8 * 8 + n / 64];
      if (!std::isfinite(v)) return Failure{name + " has a distance that is not finite"};
      f.samples.push_back(std::clamp(v, -frame.background, frame.background));
    }
    const float* s = &f.samples[f.samples.size() - 512];
    for (std::size_t n = 0; n < 512; ++n) {
      if (n % 8 == 7 || std::fabs(s[n]) >= frame.background) continue;
      ++pairs;
      steep += std::fabs(s[n + 1] - s[n]) > 1.25 * frame.voxel;
    }
  }
  if (steep > pairs / 50)
    return Failure{name + " is no distance field: its values rise faster than distances can"};
  widen(*grid, frame, f);
  far_bounds(*grid, frame, f);
  return f;
}

}  // namespace h6::io
