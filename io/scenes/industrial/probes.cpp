// SPDX-License-Identifier: Apache-2.0
// probes.cpp - finds probes from the construction, without a distance field.
//
// Inside: a piece is closed and well wound before it gets defects, so its own winding number tells
// on which side a point is. Outside: a probe lies in a cell of a coarse grid that no triangle's box
// comes near, and that faces of such cells connect to the grid's border.
#include "io/scenes/industrial/probes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace h6::io::industrial {
namespace {

using Corners = std::array<h6Vec3, 3>;

// Share of the full solid angle (van Oosterom, Strackee 1983).
double solid_angle(const Corners& t, const h6Vec3& p) {
  const h6Vec3 a = t[0] - p, b = t[1] - p, c = t[2] - p;
  const double la = norm(a), lb = norm(b), lc = norm(c);
  return 2 *
         std::atan2(dot(a, cross(b, c)),
                    la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb) /
         (4 * std::numbers::pi);
}

double to_segment(const h6Vec3& p, const h6Vec3& a, const h6Vec3& b) {
  const h6Vec3 ab = b - a;
  const double s = std::clamp(dot(p - a, ab) / std::max(dot(ab, ab), 1e-300), 0.0, 1.0);
  return norm(p - a - s * ab);
}

double to_triangle(const Corners& t, const h6Vec3& p) {
  const h6Vec3 n = cross(t[1] - t[0], t[2] - t[0]);
  const double size = norm(n);
  bool over = size > 0;
  for (std::size_t k = 0; k < 3 && over; ++k)
    over = dot(cross(t[(k + 1) % 3] - t[k], p - t[k]), n) >= 0;
  if (over) return std::abs(dot(p - t[0], n)) / size;
  return std::min(
      {to_segment(p, t[0], t[1]), to_segment(p, t[1], t[2]), to_segment(p, t[2], t[0])});
}

// A grid of cells around an assembly, with a border of free cells.
struct Cells {
  h6Vec3 low;
  double size;
  int n[3];
  std::vector<std::uint8_t> state;  // 0 unknown, 1 a triangle is near, 2 outside

  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(n[1]) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(n[0]) +
           static_cast<std::size_t>(i);
  }

  // Marks every cell that the triangle's bounding box, `margin` larger, touches. Large triangles
  // are divided first.
  void mark(const Corners& t, double margin) {
    int from[3], to[3];
    bool large = false;
    for (int a = 0; a < 3; ++a) {
      const auto x = [a](const h6Vec3& p) { return a == 0 ? p.x : a == 1 ? p.y : p.z; };
      const double lo = std::min({x(t[0]), x(t[1]), x(t[2])}) - margin;
      const double hi = std::max({x(t[0]), x(t[1]), x(t[2])}) + margin;
      from[a] = static_cast<int>(std::floor((lo - x(low)) / size));
      to[a] = static_cast<int>(std::floor((hi - x(low)) / size));
      large = large || hi - lo - 2 * margin > 3 * size;
    }
    if (large) {
      const h6Vec3 ab = 0.5 * (t[0] + t[1]), bc = 0.5 * (t[1] + t[2]), ca = 0.5 * (t[2] + t[0]);
      for (const Corners& quarter : {Corners{t[0], ab, ca}, Corners{ab, t[1], bc},
                                     Corners{ca, bc, t[2]}, Corners{ab, bc, ca}})
        mark(quarter, margin);
      return;
    }
    for (int k = from[2]; k <= to[2]; ++k)
      for (int j = from[1]; j <= to[1]; ++j)
        for (int i = from[0]; i <= to[0]; ++i) state[index(i, j, k)] = 1;
  }

  void flood() {
    std::vector<std::array<int, 3>> stack = {{0, 0, 0}};
    state[0] = 2;
    while (!stack.empty()) {
      const auto at = stack.back();
      stack.pop_back();
      for (int a = 0; a < 6; ++a) {
        auto to = at;
        to[static_cast<std::size_t>(a / 2)] += a % 2 == 0 ? 1 : -1;
        if (std::min({to[0], to[1], to[2]}) < 0 || to[0] >= n[0] || to[1] >= n[1] || to[2] >= n[2])
          continue;
        std::uint8_t& cell = state[index(to[0], to[1], to[2])];
        if (cell != 0) continue;
        cell = 2;
        stack.push_back(to);
      }
    }
  }
};

}  // namespace

void Prober::fill(IndustrialTruth& truth, std::size_t probes) const {
  solids(truth, probes);
  sheets(truth, probes);
  surroundings(truth, probes);
}

Prober::Probe Prober::behind(const Assembly::Range& range, std::size_t triangle) const {
  const auto [a, b, c] = all_.corners(triangle);
  const h6Vec3 n = cross(b - a, c - a);
  if (norm(n) < 1e-9) return {{}, range.part, 0};
  for (const double depth : {8.0, 4.0, 2.0}) {  // [voxel]
    const h6Vec3 p = (1.0 / 3) * (a + b + c) - (depth * voxel_) * unit(n);
    double winding = 0, nearest = 1e300;
    for (std::size_t t = range.first; t < range.first + range.count; ++t) {
      const Corners corners = all_.corners(t);
      winding += solid_angle(corners, p);
      nearest = std::min(nearest, to_triangle(corners, p));
    }
    if (winding > 0.999 && nearest > 1.2 * voxel_) return {kMm * p, range.part, kMm * nearest};
  }
  return {{}, range.part, 0};
}

void Prober::solids(IndustrialTruth& truth, std::size_t probes) const {
  Dice dice = all_.dice_;
  std::vector<std::uint8_t> holed(all_.ranges_.size(), 0);
  for (const Assembly::Hole& hole : all_.holes_) holed[hole.range] = 1;
  for (std::size_t i = 0; i < 40 * probes && truth.inside.size() < probes; ++i) {
    const std::size_t r = dice.below(all_.ranges_.size());
    const Assembly::Range& range = all_.ranges_[r];
    if (range.kind != Kind::solid || holed[r] != 0) continue;
    const Probe probe = behind(range, range.first + dice.below(range.count));
    if (probe.clearance > 0) truth.inside.push_back(probe);
  }
  // Every solid with a hole gets as many probes; the first are straight behind the hole.
  for (const Assembly::Hole& hole : all_.holes_) {
    const Assembly::Range& range = all_.ranges_[hole.range];
    for (const std::size_t t : hole.triangles)
      if (const Probe probe = behind(range, t); probe.clearance > 0)
        truth.behind_holes.push_back(probe);
    for (std::size_t i = 0; i < probes / (4 * all_.holes_.size()); ++i)
      if (const Probe probe = behind(range, range.first + dice.below(range.count));
          probe.clearance > 0)
        truth.behind_holes.push_back(probe);
  }
}

void Prober::sheets(IndustrialTruth& truth, std::size_t probes) const {
  Dice dice = all_.dice_;
  std::vector<std::size_t> which;
  for (std::size_t r = 0; r < all_.ranges_.size(); ++r)
    if (all_.ranges_[r].kind == Kind::sheet) which.push_back(r);
  if (which.empty()) return;
  for (std::size_t i = 0; i < 8 * probes && truth.sheets.size() < probes; ++i) {
    const Assembly::Range& range = all_.ranges_[which[dice.below(which.size())]];
    // Border edges have one face. Sheets are small, so sorting all edges is enough to find them.
    std::vector<std::array<std::uint32_t, 2>> edges, border;
    for (std::size_t t = range.first; t < range.first + range.count; ++t)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = all_.triangles_[t][k], b = all_.triangles_[t][(k + 1) % 3];
        edges.push_back({std::min(a, b), std::max(a, b)});
      }
    std::sort(edges.begin(), edges.end());
    for (std::size_t e = 0; e < edges.size();) {
      std::size_t f = e;
      while (f < edges.size() && edges[f] == edges[e]) ++f;
      if (f == e + 1) border.push_back(edges[e]);
      e = f;
    }
    for (int k = 0; k < 16; ++k) {  // many probes for each search of the border
      const auto [a, b, c] = all_.corners(range.first + dice.below(range.count));
      double u = dice.uniform(0, 1), v = dice.uniform(0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const h6Vec3 p = a + u * (b - a) + v * (c - a);
      double nearest = 1e300;
      for (const auto& [s, t] : border)
        nearest = std::min(nearest, to_segment(p, all_.points_[s], all_.points_[t]));
      if (nearest > voxel_) truth.sheets.push_back({kMm * p, range.part, kMm * nearest});
    }
  }
}

void Prober::surroundings(IndustrialTruth& truth, std::size_t probes) const {
  const double margin = 3 * voxel_;
  Cells cells;
  cells.size = 4 * voxel_;
  h6Vec3 low = all_.points_.front(), high = low;
  for (const h6Vec3& p : all_.points_) {
    low = min(low, p);
    high = max(high, p);
  }
  const double border = margin + 2 * cells.size;
  cells.low = low - h6Vec3{border, border, border};
  const h6Vec3 extent = high - cells.low;
  cells.n[0] = static_cast<int>((extent.x + border) / cells.size) + 1;
  cells.n[1] = static_cast<int>((extent.y + border) / cells.size) + 1;
  cells.n[2] = static_cast<int>((extent.z + border) / cells.size) + 1;
  cells.state.assign(cells.index(0, 0, cells.n[2]), 0);
  for (std::size_t t = 0; t < all_.triangles_.size(); ++t) cells.mark(all_.corners(t), margin);
  cells.flood();

  // Half of the probes are anywhere, half beside cells that triangles come near.
  Dice dice = all_.dice_;
  for (std::size_t tries = 0; tries < 2000 * probes && truth.outside.size() < probes; ++tries) {
    int at[3];
    for (int a = 0; a < 3; ++a)
      at[a] = 1 + static_cast<int>(dice.below(static_cast<std::size_t>(cells.n[a] - 2)));
    const std::size_t here = cells.index(at[0], at[1], at[2]);
    if (cells.state[here] != 2) continue;
    bool beside = false;
    for (const std::size_t step :
         {cells.index(1, 0, 0), cells.index(0, 1, 0), cells.index(0, 0, 1)})
      beside = beside || cells.state[here + step] == 1 || cells.state[here - step] == 1;
    if (!beside && truth.outside.size() % 2 == 0) continue;
    const h6Vec3 p = cells.low + cells.size * h6Vec3{at[0] + 0.5, at[1] + 0.5, at[2] + 0.5};
    truth.outside.push_back({kMm * p, -1, kMm * margin});
  }
}

}  // namespace h6::io::industrial
