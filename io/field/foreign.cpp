// SPDX-License-Identifier: Apache-2.0
// foreign.cpp - a field from a narrow-band level set of another program.
//
// Its values are distances where they are below the background, the half width of its band. A cell
// nearer to the surface than background - sqrt(3) voxels has such values at all its nodes: this is
// the band of our field.
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>

#include "io/field/grids.h"

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

// The number of steps, diagonals included, from each brick to the nearest one that is `near`.
std::vector<int> steps_to_near(const std::array<std::int32_t, 3>& size,
                               const std::vector<std::uint8_t>& near) {
  constexpr int kCap = 1024;
  std::vector<int> steps(near.size());
  for (std::size_t i = 0; i < near.size(); ++i) steps[i] = near[i] ? 0 : kCap;
  // The set of near bricks grows by one layer at a time.
  std::vector<std::size_t> layer, next;
  for (std::size_t i = 0; i < near.size(); ++i)
    if (near[i]) layer.push_back(i);
  const std::size_t nx = std::size_t(size[0]), ny = std::size_t(size[1]);
  for (int step = 1; !layer.empty(); ++step, layer.swap(next)) {
    next.clear();
    for (std::size_t i : layer) {
      const int at[3] = {int(i % nx), int(i / nx % ny), int(i / nx / ny)};
      for (int n = 0; n < 27; ++n) {
        const int to[3] = {at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1};
        bool in = true;
        for (std::size_t k = 0; k < 3; ++k) in &= to[k] >= 0 && to[k] < size[k];
        if (!in) continue;
        const std::size_t j =
            (std::size_t(to[2]) * ny + std::size_t(to[1])) * nx + std::size_t(to[0]);
        if (steps[j] <= step) continue;
        steps[j] = step;
        next.push_back(j);
      }
    }
  }
  return steps;
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

void far_bounds(FloatGrid& grid, const Frame& frame, const std::vector<std::uint8_t>& near,
                FieldData& f) {
  const std::vector<int> steps = steps_to_near(f.bricks, near);
  const auto access = grid.getConstAccessor();
  const int nx = f.bricks[0], ny = f.bricks[1], nz = f.bricks[2];
  for (int c = 0; c <= nz; ++c)
    for (int b = 0; b <= ny; ++b)
      for (int a = 0; a <= nx; ++a) {
        // A node past the last brick has the bound of that brick less one step.
        const int over = (a == nx) || (b == ny) || (c == nz);
        const std::size_t cell = (std::size_t(std::min(c, nz - 1)) * std::size_t(ny) +
                                  std::size_t(std::min(b, ny - 1))) *
                                     std::size_t(nx) +
                                 std::size_t(std::min(a, nx - 1));
        const float v = access.getValue(frame.low + Coord(8 * a, 8 * b, 8 * c));
        const double certain = std::min(double(std::fabs(v)), double(frame.background));
        const double bricks = 8.0 * frame.voxel * std::max(0, steps[cell] - 1 - over);
        const double bound = certain < frame.background ? certain : std::max(certain, bricks);
        f.far_grid.push_back(float(std::copysign(bound, double(v))));
      }
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
  std::vector<std::uint8_t> near(cells, 0);
  f.brick_index.assign(cells, -1);
  std::size_t pairs = 0, steep = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    if (leaf_of[c] == nullptr) continue;
    f.brick_index[c] = std::int32_t(f.brick_count());
    const float* in = leaf_of[c]->buffer().data();
    for (std::size_t n = 0; n < 512; ++n) {
      const float v = in[(n % 8) * 64 + n / 8 % 8 * 8 + n / 64];
      if (!std::isfinite(v)) return Failure{name + " has a distance that is not finite"};
      near[c] |= std::fabs(v) < frame.background;
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
  far_bounds(*grid, frame, near, f);
  return f;
}

}  // namespace h6::io
