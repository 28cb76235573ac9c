// SPDX-License-Identifier: Apache-2.0
// plan.cpp - counts the bricks near the triangles, by boxes around pieces of them.
//
// A field with a tolerance takes its memory where its surface turns: at edges, at small radii, and
// where two sheets are near. So such bricks are counted, too.
#include "io/bake/plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "io/bake/grid.h"
#include "io/field/refine.h"
#include "io/walls/pieces.h"
#include "kernels/views.h"

namespace h6::io {
namespace {

using Corners = std::array<Vec3, 3>;

constexpr double kPiece = 3;     // [voxel] longest extent
constexpr double kPieces = 3e7;  // a second's work; beyond it, triangles are sampled
// Normals that differ by more than 40 degrees in a brick are a turn.
constexpr double kTurn = 0.77;
// These numbers are fitted to the peaks of 26 meshes [bytes]. The program itself takes kProgram.
constexpr double kProgram = 50e6;
constexpr double kUniformPeak = 2.1, kUniformTriangle = 300;
// A bake to a tolerance takes this for each triangle, each coarse brick, each coarse brick in which
// the surface turns, and each coarse cell.
struct Refined {
  double triangle, brick, turn, cell;
};
// In a closed solid only the bricks in which the surface turns need fine voxels, else all do.
constexpr Refined kSome{800, 0, 55e3, 600}, kAll{800, 50e3, 50e3, 600};
// The finer samples that stay in such a brick take 3 to 37 kB.
constexpr std::size_t kFinerBytes = 8000;
// The time is guessed in the same way [s].
constexpr Refined kSomeTime{3e-6, 0, 1.5e-4, 0}, kAllTime{3e-6, 2.5e-4, 0, 0};
// A bake may fit although its estimate is up to this many times what is free. Then it finds out
// itself.
constexpr double kTooHigh = 2.1;

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
  // With `turns`, bricks in which the surface turns are counted.
  Bricks(const bake::Grid& grid, bool turns) : grid_(grid), reach_(grid.near_zero_set()) {
    near_.resize(grid.cells());
    if (turns) normal_.resize(grid.cells());
    turned_.resize(normal_.size());
  }
  void add(const Corners& c) {
    const Vec3 n = cross(c[1] - c[0], c[2] - c[0]);
    const double twice_area = norm(n);
    if (!(twice_area > 0)) return;
    mark(Piece(c[0], c[1], c[2]), (1 / twice_area) * n);
  }
  std::size_t near() const { return std::size_t(std::count(near_.begin(), near_.end(), true)); }
  std::size_t turned() const {
    return std::size_t(std::count(turned_.begin(), turned_.end(), true));
  }

 private:
  // Cuts the triangle until the pieces are small, and marks the box of each.
  void mark(const Piece& piece, const Vec3& normal) {
    if (const auto two = halves(piece, kPiece)) {
      for (const Piece& half : *two) mark(half, normal);
      return;
    }
    Vec3 least = piece.corner[0], most = least;
    for (int k = 1; k < piece.corners; ++k) {
      least = min(least, piece.corner[std::size_t(k)]);
      most = max(most, piece.corner[std::size_t(k)]);
    }
    int low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      // Nodes 0..7 of a brick, 8 voxels from one brick to the next.
      low[k] = std::max(0, int(std::ceil((component(least, k) - reach_ - 7) / 8)));
      high[k] = std::min(grid_.bricks[std::size_t(k)] - 1,
                         int(std::floor((component(most, k) + reach_) / 8)));
    }
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int x = low[0]; x <= high[0]; ++x) mark(grid_.cell(x, y, z), normal);
  }
  void mark(std::size_t cell, const Vec3& normal) {
    near_[cell] = true;
    if (normal_.empty()) return;
    Vec3& first = normal_[cell];
    if (dot(first, first) == 0) first = normal;
    if (dot(first, normal) < kTurn) turned_[cell] = true;
  }

  const bake::Grid& grid_;
  double reach_;
  std::vector<bool> near_, turned_;  // (cells); turned_: or empty
  std::vector<Vec3> normal_;         // (cells) of the first triangle, or empty
};

std::string gigabytes(double bytes) {
  char text[40];
  if (bytes < 1e9)
    std::snprintf(text, sizeof text, "%.0f MB", 1e-6 * bytes);
  else
    std::snprintf(text, sizeof text, "%.1f GB", 1e-9 * bytes);
  return text;
}

Failure does_not_fit(const std::string& about, double bytes, double free) {
  // Bricks grow with the area in voxels.
  const double by = std::ceil(10.5 * std::sqrt(bytes / std::max(1.0, free))) / 10;
  char text[80];
  std::snprintf(text, sizeof text, "choose voxels, or a tolerance, %.1f times as large", by);
  return Failure{"this bake takes " + about + gigabytes(bytes) + " of memory, and " +
                 gigabytes(free) + " are free: " + text};
}

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
  const bool refined = options.tolerance > 0;
  Bricks bricks(*grid, refined);
  const auto corners = [&](std::size_t t) {
    const auto& f = mesh.triangles[t];
    return Corners{grid->from_metres(mesh.vertices[f[0]]), grid->from_metres(mesh.vertices[f[1]]),
                   grid->from_metres(mesh.vertices[f[2]])};
  };
  double pieces = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) pieces += pieces_of(corners(t));
  const auto stride = std::size_t(std::max(1.0, std::ceil(pieces / kPieces)));
  for (std::size_t t = 0; t < mesh.triangles.size(); t += stride)
    if (pieces_of(corners(t)) < kPieces) bricks.add(corners(t));
  plan.brick_count = bricks.near();
  const std::size_t cells = grid->cells();
  plan.bytes =
      plan.brick_count * 512 * sizeof(float) + cells * (sizeof(std::int32_t) + sizeof(float));
  plan.bytes += kFinerBytes * bricks.turned();
  plan.engine_bytes = plan.brick_count * kernels::kBrickStride * sizeof(std::int16_t) +
                      (cells - plan.brick_count) * 8 * sizeof(std::int16_t) +
                      cells * sizeof(std::int32_t);
  const double triangles = double(mesh.triangles.size()), all = double(plan.brick_count);
  if (refined) {
    const auto sum = [&](const Refined& of) {
      return of.triangle * triangles + of.brick * all + of.turn * double(bricks.turned()) +
             of.cell * double(cells);
    };
    const bool some = grid->offset == 0 && audit.closed && options.sign != SignMode::flood &&
                      options.cavities == Cavities::solid &&
                      mesh.triangles.size() < bake::kDense * plan.brick_count;
    plan.peak_bytes = std::size_t(kProgram + sum(some ? kSome : kAll));
    plan.seconds = 0.05 + sum(some ? kSomeTime : kAllTime);
  } else {
    plan.peak_bytes =
        std::size_t(kProgram + kUniformPeak * double(plan.bytes) + kUniformTriangle * triangles);
    plan.seconds = 0.05 + 9e-6 * all + 1e-6 * triangles;
  }
  return plan;
}

Failure takes_more_than(double free) {
  return Failure{"this bake takes more than the " + gigabytes(free) +
                 " of memory that are still free: choose larger voxels, or a larger tolerance"};
}

Outcome room_for(double bytes, const FieldBake& options) {
  const std::optional<std::uint64_t> free = options.free_memory();
  if (!free || bytes <= double(*free)) return Done{};
  return does_not_fit("another ", bytes, double(*free));
}

Result<std::string> needs_of(const FieldPlan& plan, std::uint64_t free) {
  const double peak = double(plan.peak_bytes);
  if (peak > kTooHigh * double(free)) return does_not_fit("about ", peak, double(free));
  char text[40];
  std::snprintf(text, sizeof text, " of memory and %.1g s", plan.seconds);
  return "about " + gigabytes(peak) + text;
}

}  // namespace h6::io
