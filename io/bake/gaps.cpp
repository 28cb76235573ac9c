// SPDX-License-Identifier: Apache-2.0
// gaps.cpp - closes meshes whose open edges only miss their twins by rounding.
//
// A generator that computes sin(2 pi) puts the last vertex of a ring 1e-16 beside the first, and
// an exporter that rounds puts it a digit beside. Only vertices of odd edges move, and only where
// all odd edges find their twins: closed meshes and soups stay as they are, to the bit.
#include <algorithm>
#include <cmath>

#include "io/bake/grid.h"

namespace h6::io::bake {
namespace {

// Finds points within a tolerance of one another. A hash table of cells with linear probing.
class Nearby {
 public:
  Nearby(std::size_t count, const Vec3& low, double tolerance)
      : slots_(std::bit_ceil(4 * count + 16), kEmpty), low_(low), tolerance_(tolerance) {}

  // The nearest of the points so far that is within the tolerance of p; or p itself, which is then
  // one of them.
  std::uint32_t find_or_add(std::uint32_t number, const Large<Vec3>& points) {
    const Vec3& p = points[number];
    std::int64_t from[3], to[3];
    for (int k = 0; k < 3; ++k) {
      from[k] = cell(component(p, k) - component(low_, k) - tolerance_);
      to[k] = cell(component(p, k) - component(low_, k) + tolerance_);
    }
    double best = tolerance_;
    std::uint32_t found = number;
    for (std::int64_t z = from[2]; z <= to[2]; ++z)
      for (std::int64_t y = from[1]; y <= to[1]; ++y)
        for (std::int64_t x = from[0]; x <= to[0]; ++x)
          for (std::size_t at = hash(x, y, z); slots_[at] != kEmpty; at = (at + 1) % slots_.size())
            if (const double d = norm(points[slots_[at]] - p); d <= best) {
              if (d == best && found != number && slots_[at] > found) continue;
              best = d;
              found = slots_[at];
            }
    if (found == number) {
      std::size_t at = hash(cell(p.x - low_.x), cell(p.y - low_.y), cell(p.z - low_.z));
      while (slots_[at] != kEmpty) at = (at + 1) % slots_.size();
      slots_[at] = number;
    }
    return found;
  }

 private:
  static constexpr std::uint32_t kEmpty = ~std::uint32_t{0};
  // Cells of four tolerances: most points look into few.
  std::int64_t cell(double along) const {
    return std::int64_t(std::floor(along / (4 * tolerance_)));
  }
  std::size_t hash(std::int64_t x, std::int64_t y, std::int64_t z) const {
    std::uint64_t h = std::uint64_t(x) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 32) ^ std::uint64_t(y)) * 0xd6e8feb86659fd93u;
    h = (h ^ (h >> 29) ^ std::uint64_t(z)) * 0xa0761d6478bd642fu;
    return std::size_t(h ^ (h >> 32)) & (slots_.size() - 1);
  }

  std::vector<std::uint32_t> slots_;
  Vec3 low_;
  double tolerance_;
};

}  // namespace

void weld_gaps(const Mesh& mesh, double tolerance, unsigned threads, Surface& surface,
               GapWeld& welded) {
  std::vector<std::uint8_t> is_odd(surface.vertices.size(), 0);
  for (const auto& edge : surface.odd) is_odd[edge[0]] = is_odd[edge[1]] = 1;
  const std::size_t rim = std::size_t(std::count(is_odd.begin(), is_odd.end(), 1));
  Mesh closer;
  std::vector<std::uint32_t> twin(surface.vertices.size());
  Nearby nearby(rim, surface.low, tolerance);
  GapWeld found;
  for (std::uint32_t v = 0; v < twin.size(); ++v) {
    twin[v] = v;
    if (!is_odd[v]) continue;
    twin[v] = nearby.find_or_add(v, surface.vertices);
    if (twin[v] == v) continue;
    ++found.vertices;
    found.widest = std::max(found.widest, norm(surface.vertices[v] - surface.vertices[twin[v]]));
  }
  // A slit has two tips at most and at least one pair of twins. So a soup, whose vertices have few
  // twins, ends here.
  if (found.vertices == 0 || 4 * found.vertices < rim) return;
  closer.vertices = mesh.vertices;
  closer.part = mesh.part;
  closer.triangles = mesh.triangles;
  for (auto& t : closer.triangles)
    for (std::uint32_t& v : t) v = twin[v];
  Result<Surface> again = prepare_surface(closer, threads);
  // A ribbon narrower than the tolerance would close upon itself and vanish.
  if (!again || again->triangles.size() < surface.triangles.size()) return;
  if (!again->closed) {
    found.left = again->odd_edges;
    if (found.left < surface.odd_edges) welded = found;
    return;
  }
  surface = std::move(*again);
  welded = found;
}

}  // namespace h6::io::bake
