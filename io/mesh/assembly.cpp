// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/assembly.h"

#include <algorithm>

namespace h6::io {
namespace {

// They need about 7 GB while the file is read.
constexpr std::uint64_t kMaxTriangles = 50'000'000, kMaxPoints = 3 * kMaxTriangles;
constexpr std::size_t kMaxParts = 100'000;

struct Total {
  std::uint64_t triangles = 0, points = 0, faces = 0, corners = 0;
};

// Sums are checked after every shape, and no shape is larger than memory: they cannot overflow.
Total count(const std::vector<Placed>& placed, const MeshSource& source) {
  Total total;
  for (const Placed& p : placed) {
    total.faces += p.shape->sizes.size();
    total.corners += p.shape->corners.size();
    total.points += p.shape->points.size();
    total.triangles = total.corners - 2 * total.faces;
    if (total.triangles > kMaxTriangles || total.points > kMaxPoints)
      source.fail("its nodes repeat their meshes to more than " + std::to_string(kMaxTriangles) +
                  " triangles; split the file");
  }
  if (placed.size() > kMaxParts)
    source.fail("more than " + std::to_string(kMaxParts) + " nodes have a mesh; join some");
  return total;
}

void append_points(const Placed& p, const MeshSource& source, std::vector<Vec3>& points) {
  const auto place = [&] { return "part '" + p.part + "'"; };
  for (const Vec3& local : p.shape->points) {
    const Vec3 q = p.place * local;
    points.push_back({coordinate(source, q.x, place), coordinate(source, q.y, place),
                      coordinate(source, q.z, place)});
  }
}

void append_faces(const Placed& p, std::uint32_t base, Polygons& out) {
  const Shape& shape = *p.shape;
  const bool backwards = mirrors(p.place);
  const std::size_t begin = out.corners.size();
  for (const std::uint32_t corner : shape.corners) out.corners.push_back(base + corner);
  out.sizes.insert(out.sizes.end(), shape.sizes.begin(), shape.sizes.end());
  if (!backwards) return;
  auto first = out.corners.begin() + static_cast<std::ptrdiff_t>(begin);
  for (const std::uint32_t size : shape.sizes) {
    std::reverse(first, first + size);
    first += size;
  }
}

}  // namespace

Affine operator*(const Affine& outer, const Affine& inner) {
  Affine m;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 4; ++j) {
      double sum = j == 3 ? outer.row[i][3] : 0;
      for (std::size_t k = 0; k < 3; ++k) sum += outer.row[i][k] * inner.row[k][j];
      m.row[i][j] = sum;
    }
  return m;
}

Vec3 operator*(const Affine& m, const Vec3& p) {
  const auto axis = [&](std::size_t i) {
    return m.row[i][0] * p.x + m.row[i][1] * p.y + m.row[i][2] * p.z + m.row[i][3];
  };
  return {axis(0), axis(1), axis(2)};
}

bool mirrors(const Affine& m) {
  const auto& [a, b, c] = m.row;
  return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
             a[2] * (b[0] * c[1] - b[1] * c[0]) <
         0;
}

Affine translation(double x, double y, double z) {
  return {{{{1, 0, 0, x}, {0, 1, 0, y}, {0, 0, 1, z}}}};
}

Affine scaling(double x, double y, double z) {
  return {{{{x, 0, 0, 0}, {0, y, 0, 0}, {0, 0, z, 0}}}};
}

Affine rotation(double x, double y, double z, double w) {
  return {{{{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 0},
            {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), 0},
            {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), 0}}}};
}

Mesh expand(const std::vector<Placed>& placed, const MeshSource& source) {
  const Total total = count(placed, source);
  Polygons all;
  all.points.reserve(total.points);
  all.corners.reserve(total.corners);
  all.sizes.reserve(total.faces);
  for (const Placed& p : placed) {
    if (p.shape->sizes.empty()) continue;
    append_faces(p, static_cast<std::uint32_t>(all.points.size()), all);
    append_points(p, source, all.points);
    all.part.resize(all.sizes.size(), static_cast<std::int32_t>(all.part_names.size()));
    all.part_names.push_back(p.part);
  }
  return assemble(std::move(all), source);
}

}  // namespace h6::io
