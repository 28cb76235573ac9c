// bake_distance.cpp - the unsigned distance of one brick's nodes to the triangles near it.
#include <algorithm>

#include "io/bake_grid.h"

namespace h6::io::bake {
namespace {

// The kernel works in float: corners farther away than this are cut off first, in double.
constexpr double kFar = 100;  // [voxel]

using Corner = std::array<double, 3>;
using Polygon = std::vector<Corner>;

// Keeps the part of a convex polygon with side * (p[axis] - level) <= 0.
void cut(Polygon& polygon, std::size_t axis, double level, double side, Polygon& kept) {
  kept.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Corner &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double at = side * (p[axis] - level), next = side * (q[axis] - level);
    if (at <= 0) kept.push_back(p);
    if ((at < 0 && next > 0) || (at > 0 && next < 0)) {
      const double s = at / (at - next);
      Corner c;
      for (std::size_t k = 0; k < 3; ++k) c[k] = p[k] + s * (q[k] - p[k]);
      kept.push_back(c);
    }
  }
  polygon.swap(kept);
}

void add_triangle(std::vector<double>& corners, const Corner& a, const Corner& b, const Corner& c) {
  corners.insert(corners.end(), a.begin(), a.end());
  corners.insert(corners.end(), b.begin(), b.end());
  corners.insert(corners.end(), c.begin(), c.end());
}

// What of a large triangle can be within reach of the brick, as a fan.
void add_part_near(std::vector<double>& corners, const Corner (&t)[3], double reach) {
  Polygon polygon(t, t + 3), scratch;
  for (std::size_t k = 0; k < 3; ++k) {
    cut(polygon, k, 8.0 + reach, 1.0, scratch);
    cut(polygon, k, -1.0 - reach, -1.0, scratch);
  }
  for (std::size_t i = 2; i < polygon.size(); ++i)
    add_triangle(corners, polygon[0], polygon[i - 1], polygon[i]);
}

// The part of the mesh nearest to the middle of the brick; the first of equals.
std::int32_t nearest_part(const Surface& surface, const std::vector<std::uint32_t>& owner,
                          const std::vector<double>& corners) {
  const double middle[3] = {3.5, 3.5, 3.5};
  double nearest = std::numeric_limits<double>::max();
  std::int32_t part = 0;
  for (std::size_t i = 0; i < owner.size(); ++i) {
    const double* t = corners.data() + 9 * i;
    const double d2 = kernels::point_triangle_squared(middle, t, t + 3, t + 6);
    if (d2 >= nearest) continue;
    nearest = d2;
    part = surface.part[owner[i]];
  }
  return part;
}

}  // namespace

void measure_row(const Surface& surface, const Grid& grid, std::size_t row, NarrowBand& band) {
  thread_local std::vector<double> corners;
  thread_local std::vector<std::uint32_t> owner;
  corners.clear();
  owner.clear();
  const auto begin = band.triangle.begin() + std::ptrdiff_t(band.first[row]);
  const auto end = band.triangle.begin() + std::ptrdiff_t(band.first[row + 1]);
  std::sort(begin, end);  // filled by many threads in any order; the result must not show it
  const std::array<int, 3> place = grid.place(band.cell[row]);
  const bool parts = !surface.part.empty();
  for (auto t = begin; t != end; ++t) {
    Corner corner[3];
    double farthest = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3& v = surface.vertices[surface.triangles[*t][i]];
      corner[i] = {v.x - 8.0 * place[0], v.y - 8.0 * place[1], v.z - 8.0 * place[2]};
      for (double c : corner[i]) farthest = std::max(farthest, std::fabs(c));
    }
    if (farthest < kFar)
      add_triangle(corners, corner[0], corner[1], corner[2]);
    else
      add_part_near(corners, corner, grid.reach());
    if (parts) owner.resize(corners.size() / 9, *t);
  }
  kernels::triangle_distance(corners.data(), corners.size() / 9, float(grid.reach()),
                             band.u.get() + row * kBrickSamples);
  if (parts) band.part[row] = nearest_part(surface, owner, corners);
}

}  // namespace h6::io::bake
