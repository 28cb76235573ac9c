// SPDX-License-Identifier: Apache-2.0
// pockets.cpp - outside nodes at the bottom of grooves narrower than a voxel.
//
// Triangles cross all edges from such a node to its neighbours, so the flood cannot reach it. Each
// candidate is judged alone. The parity of crossings towards reached nodes rejects nearly all (odd:
// the tip of a solid). Then a reached node in plain view decides, and at last a walk of a few
// voxels on a lattice eight times finer.
#include <algorithm>

#include "io/bake/grid.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr int kView = 2;  // nodes along each axis; a row knows all triangles so far
constexpr int kFine = 8;  // steps a voxel
constexpr int kSide = 2 * kView * kFine + 1;

struct Facet {
  Vec3 a, e, f;  // corner and two edges
};

// Whether p + t d, t in [0, 1], meets the triangle (T. Moeller, B. Trumbore, 1997). Touching
// counts.
bool meets(const Vec3& p, const Vec3& d, const Facet& t) {
  constexpr double kTouch = 1e-7;
  const Vec3 h = cross(d, t.f);
  const double det = dot(t.e, h);
  if (det == 0) return false;
  const Vec3 s = p - t.a, q = cross(s, t.e);
  const double u = dot(s, h) / det, v = dot(d, q) / det, w = dot(t.f, q) / det;
  return u >= -kTouch && v >= -kTouch && u + v <= 1 + kTouch && w >= 0 && w <= 1;
}

class View {
 public:
  View(const Surface& surface, const Grid& grid, const NarrowBand& band, const Masks& wet)
      : surface_(surface), grid_(grid), band_(band), wet_(wet) {}

  // The facets near the nodes of a row.
  std::vector<Facet> facets_of(std::size_t row) const {
    const Tiles& tiles = band_.tiles;
    const std::array<int, 3> brick = grid_.place(band_.cell[row]);
    const std::size_t tile = tiles.of(brick);
    std::vector<Facet> facets;
    for (std::size_t i = tiles.first[tile]; i < tiles.first[tile + 1]; ++i) {
      if (!(tiles.near[i] >> Tiles::bit(brick) & 1)) continue;
      const auto& t = surface_.triangles[tiles.triangle[i]];
      const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
                 &c = surface_.vertices[t[2]];
      facets.push_back({a, b - a, c - a});
    }
    return facets;
  }

  bool reaches_outside(const std::vector<Facet>& facets, const std::array<int, 3>& p) const {
    const Vec3 eye{double(p[0]), double(p[1]), double(p[2])};
    const std::vector<Facet> near = facets_near(facets, eye);
    int odd = 0, looks = 0;
    for (int i = 0; i < 125; ++i) {
      const std::array<int, 3> d = {i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2};
      if (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > grid_.reach() * grid_.reach()) continue;
      if (!is_wet({p[0] + d[0], p[1] + d[1], p[2] + d[2]})) continue;
      const Vec3 way{double(d[0]), double(d[1]), double(d[2])};
      const auto hits = std::count_if(near.begin(), near.end(),
                                      [&](const Facet& t) { return meets(eye, way, t); });
      if (hits == 0) return true;
      odd += hits % 2;
      if (++looks == 5 && odd > 2) return false;
    }
    return looks > 0 && 2 * odd <= looks && walks_outside(near, p);
  }

 private:
  bool is_wet(const std::array<int, 3>& n) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (n[k] < 0 || n[k] >= 8 * grid_.bricks[k]) return false;
    const std::int32_t r = band_.row[grid_.cell(n[0] / 8, n[1] / 8, n[2] / 8)];
    return r >= 0 &&
           wet_[std::size_t(r)].get(std::size_t(((n[2] & 7) * 8 + (n[1] & 7)) * 8 + (n[0] & 7)));
  }

  // Searches breadth first, from the middle of a cube of fine steps, for a reached node in it.
  bool walks_outside(const std::vector<Facet>& near, const std::array<int, 3>& p) const {
    std::vector<std::uint8_t> seen(kSide * kSide * kSide, 0);
    std::vector<int> queue{int(seen.size() / 2)};
    seen[std::size_t(queue[0])] = 1;
    for (std::size_t at = 0; at < queue.size(); ++at) {
      const int q[3] = {queue[at] % kSide, queue[at] / kSide % kSide, queue[at] / kSide / kSide};
      if (q[0] % kFine == 0 && q[1] % kFine == 0 && q[2] % kFine == 0 &&
          is_wet({p[0] + q[0] / kFine - kView, p[1] + q[1] / kFine - kView,
                  p[2] + q[2] / kFine - kView}))
        return true;
      const Vec3 from{p[0] + double(q[0]) / kFine - kView, p[1] + double(q[1]) / kFine - kView,
                      p[2] + double(q[2]) / kFine - kView};
      for (int way = 0; way < 6; ++way) {
        const int axis = way / 2, step = way % 2 ? 1 : -1;
        if (q[axis] + step < 0 || q[axis] + step >= kSide) continue;
        const int to = queue[at] + step * (axis == 0 ? 1 : axis == 1 ? kSide : kSide * kSide);
        if (seen[std::size_t(to)]) continue;
        double d[3] = {0, 0, 0};
        d[axis] = double(step) / kFine;
        if (std::any_of(near.begin(), near.end(), [&](const Facet& t) {
              return meets(from, {d[0], d[1], d[2]}, t);
            }))
          continue;
        seen[std::size_t(to)] = 1;
        queue.push_back(to);
      }
    }
    return false;
  }

  static std::vector<Facet> facets_near(const std::vector<Facet>& facets, const Vec3& eye) {
    std::vector<Facet> near;
    const auto apart = [](double p, double e, double f, double at) {
      return p + std::min({0.0, e, f}) > at + kView || p + std::max({0.0, e, f}) < at - kView;
    };
    for (const Facet& t : facets)
      if (!apart(t.a.x, t.e.x, t.f.x, eye.x) && !apart(t.a.y, t.e.y, t.f.y, eye.y) &&
          !apart(t.a.z, t.e.z, t.f.z, eye.z))
        near.push_back(t);
    return near;
  }

  const Surface& surface_;
  const Grid& grid_;
  const NarrowBand& band_;
  const Masks& wet_;
};

}  // namespace

std::vector<RowNodes> reachable(const Surface& surface, const Grid& grid, const NarrowBand& band,
                                const std::vector<RowNodes>& candidates, const Masks& wet,
                                unsigned threads) {
  std::vector<RowNodes> seen(candidates);
  const View view(surface, grid, band, wet);
  sched::parallel_for(candidates.size(), threads, [&](std::size_t i) {
    const std::size_t r = candidates[i].row;
    const std::array<int, 3> place = grid.place(band.cell[r]);
    const std::vector<Facet> facets = view.facets_of(r);
    seen[i].nodes = NodeMask{};
    for (std::size_t z = 0; z < 8; ++z)
      for (std::uint64_t bits = candidates[i].nodes.z[z]; bits != 0; bits &= bits - 1) {
        const int n = std::countr_zero(bits);
        if (view.reaches_outside(
                facets, {8 * place[0] + n % 8, 8 * place[1] + n / 8, 8 * place[2] + int(z)}))
          seen[i].nodes.set(64 * z + std::size_t(n));
      }
  });
  std::erase_if(seen, [](const RowNodes& row) { return !row.nodes.any(); });
  return seen;
}

}  // namespace h6::io::bake
