// SPDX-License-Identifier: Apache-2.0
#include "io/deform/lattice.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <unordered_map>

#include "io/bake/bake_field.h"
#include "io/field/view.h"

namespace h6::io {
namespace {

// Whether places lie inside a baked field.
class Inside {
 public:
  explicit Inside(const FieldData& field) : field_(field), view_(field) {}
  bool at(const h6Vec3& p) const {
    const Vec3 g = view_.from_metres(p);
    double d = 0;
    if (view_.distance(g, d)) return d < 0;
    // Away from the surface all of a brick is on one side: that of its first far node.
    std::size_t node[3];
    for (int axis = 0; axis < 3; ++axis) {
      const double brick = std::floor(component(g, axis) / 8);
      if (brick < 0 || brick >= field_.bricks[axis]) return false;
      node[axis] = static_cast<std::size_t>(brick);
    }
    const std::size_t wide = field_.bricks[0] + 1, high = field_.bricks[1] + 1;
    return field_.far_grid[(node[2] * high + node[1]) * wide + node[0]] < 0;
  }

 private:
  const FieldData& field_;
  FieldView view_;
};

struct Grid {
  h6Vec3 origin;
  double cell;
  std::size_t count[3];
  h6Vec3 at(double i, double j, double k) const { return origin + cell * h6Vec3{i, j, k}; }
};

// Cells that just cover the box, centred on it.
Result<Grid> plan_grid(const MeshBounds& box, double cell) {
  Grid grid{{}, cell, {}};
  const h6Vec3 size = box.high - box.low;
  double all = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = std::max(1.0, std::ceil(component(size, axis) / cell - 1e-9));
    all *= cells;
    grid.count[axis] = cells < 1e9 ? static_cast<std::size_t>(cells) : 0;
  }
  if (all > 50.0 * kMostCells)
    return Failure{"Cells of this size would be too many; choose a larger --cell."};
  const auto start = [&](int axis) {
    return 0.5 * (component(box.low, axis) + component(box.high, axis) -
                  cell * static_cast<double>(grid.count[axis]));
  };
  grid.origin = {start(0), start(1), start(2)};
  return grid;
}

class LatticeBuilder {
 public:
  LatticeBuilder(const Grid& grid, const Inside& inside) : grid_(grid), inside_(inside) {}

  SolidMesh build() {
    const auto [nx, ny, nz] = grid_.count;
    std::vector<bool> node((nx + 1) * (ny + 1) * (nz + 1));
    for (std::size_t k = 0; k <= nz; ++k)
      for (std::size_t j = 0; j <= ny; ++j)
        for (std::size_t i = 0; i <= nx; ++i) node[place(i, j, k)] = inside_.at(at(i, j, k));
    for (std::size_t k = 0; k < nz; ++k)
      for (std::size_t j = 0; j < ny; ++j)
        for (std::size_t i = 0; i < nx; ++i) {
          const auto corners = corners_of_cell(i, j, k);
          if (std::any_of(corners.begin(), corners.end(), [&](std::size_t c) { return node[c]; }) ||
              inside_.at(grid_.at(i + 0.5, j + 0.5, k + 0.5)))
            add(corners);
        }
    return std::move(mesh_);
  }

 private:
  std::size_t place(std::size_t i, std::size_t j, std::size_t k) const {
    return (k * (grid_.count[1] + 1) + j) * (grid_.count[0] + 1) + i;
  }
  h6Vec3 at(std::size_t i, std::size_t j, std::size_t k) const {
    return grid_.at(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
  }
  std::array<std::size_t, 8> corners_of_cell(std::size_t i, std::size_t j, std::size_t k) const {
    return {place(i, j, k),
            place(i + 1, j, k),
            place(i + 1, j + 1, k),
            place(i, j + 1, k),
            place(i, j, k + 1),
            place(i + 1, j, k + 1),
            place(i + 1, j + 1, k + 1),
            place(i, j + 1, k + 1)};
  }
  void add(const std::array<std::size_t, 8>& corners) {
    SolidElement e;
    e.corners = 8;
    e.material = kNoMaterial;
    for (int a = 0; a < 8; ++a) {
      const auto [found, fresh] = number_.emplace(corners[a], mesh_.vertices.size());
      e.corner[a] = static_cast<std::uint32_t>(found->second);
      if (!fresh) continue;
      const std::size_t wide = grid_.count[0] + 1, high = grid_.count[1] + 1;
      mesh_.vertices.push_back(
          at(corners[a] % wide, corners[a] / wide % high, corners[a] / wide / high));
    }
    mesh_.elements.push_back(e);
  }

  const Grid& grid_;
  const Inside& inside_;
  std::unordered_map<std::size_t, std::size_t> number_;
  SolidMesh mesh_;
};

}  // namespace

Result<SolidMesh> make_lattice(const Mesh& mesh, double cell, unsigned threads,
                               const Progress& progress) {
  if (!(cell > 0) || !std::isfinite(cell)) return Failure{"The size of a cell must be above 0."};
  const MeshAudit found = audit(mesh);
  if (!found.closed)
    return Failure{
        "The mesh is open, so it has no inside to fill with cells; close it, or give a "
        "mesh of tetrahedra or hexahedra."};
  const MeshBounds box = bounds_of(mesh);
  const Result<Grid> grid = plan_grid(box, cell);
  if (!grid) return grid.failure();
  FieldBake bake;
  bake.threads = threads;
  bake.voxels = std::clamp(static_cast<int>(4 * box.longest() / cell) + 16, 32, 512);
  const Result<FieldData> field = bake_field(mesh, bake, nullptr, progress);
  if (!field) return field.failure();
  SolidMesh lattice = LatticeBuilder(*grid, Inside(*field)).build();
  if (lattice.elements.empty())
    return Failure{"No cell of this size is inside the mesh; choose a smaller --cell."};
  if (lattice.elements.size() > kMostCells)
    return Failure{"The lattice would have " + std::to_string(lattice.elements.size()) +
                   " cells, at most " + std::to_string(kMostCells) +
                   " can be used; choose a larger --cell."};
  char text[160];
  std::snprintf(
      text, sizeof text,
      "The lattice has %zu cells and %.4g times the mesh's volume; a smaller --cell "
      "follows the mesh more closely.",
      lattice.elements.size(),
      static_cast<double>(lattice.elements.size()) * cell * cell * cell / std::abs(found.volume));
  lattice.remarks.push_back(text);
  return lattice;
}

}  // namespace h6::io
