// SPDX-License-Identifier: Apache-2.0
// plan.cpp - counts the bricks near the triangles, by boxes around pieces of them.
#include "io/bake/plan.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "io/bake/grid.h"
#include "io/field/refine.h"
#include "kernels/views.h"

namespace h6::io {
namespace {

using Corners = std::array<Vec3, 3>;

constexpr double kPiece = 4;     // [voxel] longest edge
constexpr double kPieces = 3e7;  // a second's work; beyond it, triangles are sampled

// Estimates the number of pieces that a triangle is cut into.
double pieces_of(const Corners& c) {
  const Vec3 u = c[1] - c[0], v = c[2] - c[0];
  const Vec3 n = cross(u, v);
  const double longest = std::sqrt(std::max({dot(u, u), dot(v, v), dot(u - v, u - v)}));
  return 1 + 2 * longest / kPiece + 2 * std::sqrt(dot(n, n)) / (kPiece * kPiece);
}

// The set of bricks near triangles.
class Bricks {
 public:
  Bricks(const bake::Grid& grid) : grid_(grid), reach_(grid.near_zero_set()) {
    near_.resize(grid.cells());
  }
  // Halves the triangle's longest edge until the pieces are small, and marks the box of each.
  void mark(const Corners& c) {
    int a = 0;
    double longest2 = -1;
    for (int k = 0; k < 3; ++k) {
      const Vec3 &p = c[std::size_t(k)], &q = c[std::size_t((k + 1) % 3)];
      const double l2 = dot(p - q, p - q);
      if (l2 > longest2) longest2 = l2, a = k;
    }
    if (longest2 > kPiece * kPiece) {
      const Vec3 &p = c[std::size_t(a)], &q = c[std::size_t((a + 1) % 3)],
                 &r = c[std::size_t((a + 2) % 3)];
      const Vec3 m{(p.x + q.x) / 2, (p.y + q.y) / 2, (p.z + q.z) / 2};
      mark({p, m, r});
      mark({m, q, r});
      return;
    }
    int low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      const auto [least, most] =
          std::minmax({component(c[0], k), component(c[1], k), component(c[2], k)});
      // Nodes 0..7 of a brick, 8 voxels from one brick to the next.
      low[k] = std::max(0, int(std::ceil((least - reach_ - 7) / 8)));
      high[k] = std::min(grid_.bricks[std::size_t(k)] - 1, int(std::floor((most + reach_) / 8)));
    }
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int x = low[0]; x <= high[0]; ++x) near_[grid_.cell(x, y, z)] = true;
  }
  std::size_t count() const { return std::size_t(std::count(near_.begin(), near_.end(), true)); }

 private:
  const bake::Grid& grid_;
  double reach_;
  std::vector<bool> near_;
};

}  // namespace

Result<FieldPlan> plan_field(const Mesh& mesh, const MeshAudit& audit, const FieldBake& options) {
  bake::Surface box;
  box.low = audit.low, box.high = audit.high;
  FieldBake coarse = options;
  if (options.tolerance > 0) {
    const double fine = 2 * options.tolerance;
    coarse.voxel_size = kCut * fine;
    const bool bare = audit.closed || options.sign == SignMode::winding;
    if (options.offset < 0) coarse.offset = bare ? 0 : 0.9 * fine;
  }
  const Result<bake::Grid> grid = bake::choose_grid(box, coarse, audit.closed);
  if (!grid) return grid.failure();
  FieldPlan plan;
  plan.voxel_size = grid->voxel, plan.offset = grid->offset * grid->voxel;
  plan.bricks = grid->bricks;
  Bricks bricks(*grid);
  const auto corners = [&](std::size_t t) {
    const auto& f = mesh.triangles[t];
    return Corners{grid->from_metres(mesh.vertices[f[0]]), grid->from_metres(mesh.vertices[f[1]]),
                   grid->from_metres(mesh.vertices[f[2]])};
  };
  double pieces = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) pieces += pieces_of(corners(t));
  const auto stride = std::size_t(std::max(1.0, std::ceil(pieces / kPieces)));
  for (std::size_t t = 0; t < mesh.triangles.size(); t += stride)
    if (pieces_of(corners(t)) < kPieces) bricks.mark(corners(t));
  plan.brick_count = bricks.count();
  const std::size_t cells = grid->cells();
  plan.bytes =
      plan.brick_count * 512 * sizeof(float) + cells * (sizeof(std::int32_t) + sizeof(float));
  // While it bakes, a field with a tolerance is also there in fine voxels, on the same area.
  if (options.tolerance > 0) plan.bytes *= 1 + kCut * kCut;
  plan.engine_bytes = plan.brick_count * kernels::kBrickStride * sizeof(std::int16_t) +
                      (cells - plan.brick_count) * 8 * sizeof(std::int16_t) +
                      cells * sizeof(std::int32_t);
  plan.seconds = 0.05 + 9e-6 * double(plan.brick_count) + 1e-6 * double(mesh.triangles.size());
  return plan;
}

}  // namespace h6::io
