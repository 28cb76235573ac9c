// SPDX-License-Identifier: Apache-2.0
// plan.cpp - counts the bricks near the triangles, by boxes around pieces of them.
#include "io/bake/plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "io/bake/grid.h"
#include "io/field/refine.h"
#include "kernels/views.h"

namespace h6::io {
namespace {

using Corners = std::array<Vec3, 3>;

constexpr double kPiece = 4;     // [voxel] longest edge
constexpr double kPieces = 3e7;  // a second's work; beyond it, triangles are sampled
// Peak of a bake over the bytes of its field; of a refined field the fine bricks reach twice as
// far.
constexpr double kPeak = 1.6, kRefinedPeak = 4;
constexpr std::size_t kProgram = 65'000'000;  // of the program itself
constexpr std::size_t kBytesATriangle = 300;

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
  if (!(norm(audit.high - audit.low) > 0))
    return Failure{"the mesh has no triangle with area: there is nothing to make a field of"};
  const Result<bake::Grid> grid = [&]() -> Result<bake::Grid> {
    if (options.tolerance == 0) return bake::choose_grid(box, options, audit.closed);
    const Result<bake::GridLevels> levels = bake::choose_grids(box, options, audit.closed);
    if (!levels) return levels.failure();
    return levels->coarse;
  }();
  if (!grid) return grid.failure();
  FieldPlan plan;
  plan.finest = options.tolerance > 0 ? kFinest * options.tolerance : grid->voxel;
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
  const bool refined = options.tolerance > 0;
  plan.peak_bytes = kProgram + std::size_t((refined ? kRefinedPeak : kPeak) * double(plan.bytes)) +
                    kBytesATriangle * mesh.triangles.size();
  plan.seconds = 0.05 + (refined ? 50 : 1) * 9e-6 * double(plan.brick_count) +
                 1e-6 * double(mesh.triangles.size());
  return plan;
}

Result<std::string> needs_of(const FieldPlan& plan, std::uint64_t free) {
  const auto gigabytes = [](double bytes) {
    char text[40];
    if (bytes < 1e9)
      std::snprintf(text, sizeof text, "%.0f MB", 1e-6 * bytes);
    else
      std::snprintf(text, sizeof text, "%.1f GB", 1e-9 * bytes);
    return std::string(text);
  };
  const double peak = double(plan.peak_bytes);
  char text[160];
  if (plan.peak_bytes > free) {
    std::snprintf(text, sizeof text, "choose voxels, or a tolerance, %.1f times as large",
                  std::ceil(10.5 * std::sqrt(peak / std::max(1.0, double(free)))) / 10);
    return Failure{"this bake takes about " + gigabytes(peak) + " of memory, and " +
                   gigabytes(double(free)) + " are free: " + text};
  }
  std::snprintf(text, sizeof text, " of memory and %.1g s", plan.seconds);
  return "about " + gigabytes(peak) + text;
}

}  // namespace h6::io
