// SPDX-License-Identifier: Apache-2.0
// zero_set.cpp - candidates on the zero set of a field.
//
// Darts fall uniformly into the volume. Those that hit a layer half a voxel thick just outside the
// surface count. |grad d| = 1 there, so the layer holds equally many hits above every piece of
// surface, at any slope against the grid. Samples outside are exact distances minus the offset;
// samples inside need not be, and nothing here uses them. A first thinning follows. Then each
// candidate moves along the line to the nearest point of the mesh until the offset is all that lies
// between, which is exact even where the grid rounds creases off.
#include <algorithm>
#include <cmath>

#include "io/file/mix.h"
#include "io/shell/candidates.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr double layer_low = 0.1, layer_high = 0.6;  // [voxel]
constexpr double out_again = 0.3, slack = 0.5;       // [voxel]

// Three numbers in [0, 1) from 63 bits.
void three_units(std::uint64_t bits, double out[3]) {
  for (int k = 0; k < 3; ++k) out[k] = double((bits >> (21 * k)) & 0x1FFFFF) * 0x1p-21;
}

struct BrickPart {  // the candidates of one brick
  RawVector<OrientedPoint> points;
};

class Layer {
 public:
  Layer(const FieldData& field, const Demand& demand)
      : field_(field), view_(field), seed_(demand.seed) {
    for (std::size_t cell = 0; cell < field.brick_index.size(); ++cell) {
      if (field.brick_index[cell] >= 0) bricks_.push_back(std::uint32_t(cell));
    }
  }
  std::size_t bricks() const { return bricks_.size(); }

  // Throws `rate` darts per cell on average and returns the number of hits. Writes them to `part`
  // unless it is null.
  std::size_t throw_darts(std::size_t row, double rate, BrickPart* part) const {
    const std::size_t brick = bricks_[row];
    const auto bx = std::size_t(field_.bricks[0]), by = std::size_t(field_.bricks[1]);
    const std::array<std::int32_t, 3> low{std::int32_t(8 * (brick % bx)),
                                          std::int32_t(8 * (brick / bx % by)),
                                          std::int32_t(8 * (brick / bx / by))};
    std::size_t hits = 0;
    for (std::int32_t i = 0; i < 512; ++i) {
      const std::array<std::int32_t, 3> cell{low[0] + i % 8, low[1] + i / 8 % 8, low[2] + i / 64};
      float corner[8];
      if (!holds_layer(brick, i) || !view_.corners(cell, corner)) continue;
      const auto [least, most] = std::minmax_element(corner, corner + 8);
      const double h = field_.voxel_size;
      if (*least > layer_high * h || *most < layer_low * h) continue;
      const std::uint64_t key = mix(seed_, 512 * std::uint64_t(brick) + std::uint64_t(i));
      const double fraction = double(key >> 11) * 0x1p-53;
      const auto darts = std::uint64_t(rate + fraction);
      for (std::uint64_t dart = 0; dart < darts; ++dart) {
        double at[3];
        three_units(mix(key, dart), at);
        hits += throw_one(cell, corner, at, part);
      }
    }
    return hits;
  }

 private:
  // A quick test of the cell's first node: trilinear values within a cell differ by at most its
  // diagonal, and by a little more where the field jumps.
  bool holds_layer(std::size_t brick, std::int32_t node) const {
    const float* samples = field_.samples.data() + std::size_t(field_.brick_index[brick]) * 512;
    return samples[node] < 2.5 * field_.voxel_size;
  }

  bool throw_one(const std::array<std::int32_t, 3>& cell, const float corner[8], const double at[3],
                 BrickPart* part) const {
    Vec3 g{};
    const double h = field_.voxel_size, d = trilinear(corner, at, &g) / h;
    if (!(d > layer_low && d < layer_high)) return false;
    if (!part) return true;
    const double length = std::sqrt(dot(g, g));
    if (!(length > 0.1 * h)) return false;
    OrientedPoint q;
    const double n[3] = {g.x / length, g.y / length, g.z / length};
    for (int k = 0; k < 3; ++k) {
      q.p[k] = float(cell[k] + at[k] - d * n[k]);
      q.n[k] = float(-n[k]);
    }
    part->points.push_back(q);
    return true;
  }

  const FieldData& field_;
  FieldView view_;
  std::uint64_t seed_;
  std::vector<std::uint32_t> bricks_;
};

// Moves a point from just outside the zero set to where the distance to the mesh is the offset, and
// returns the nearest triangle. On the way from a place to its nearest point, the nearest point
// stays the same, so the result is exact. A place nearer than the offset (the grid rounds creases
// off) first moves out, and the search starts again.
std::uint32_t settle(const ZeroSet& of, OrientedPoint& q) {
  const FieldView view(*of.field);
  const double h = of.field->voxel_size, sigma = of.field->offset;
  Vec3 n{-q.n[0], -q.n[1], -q.n[2]};
  Vec3 p = view.to_metres(Vec3{q.p[0], q.p[1], q.p[2]} + out_again * n);
  RayScene::Near hit;
  for (int round = 0; round < 5; ++round) {
    hit = of.nearest->nearest(p, sigma + (out_again + slack) * h);
    if (hit.triangle == RayScene::kNoTriangle) hit = of.nearest->nearest(p);
    const double u = hit.distance;
    if (u > 1e-6 * h) n = (1 / u) * (p - hit.point);
    if (u >= sigma) break;
    p = hit.point + (sigma + out_again * h) * n;
  }
  const Vec3 place = view.from_metres(hit.point + sigma * n);
  if (of.triangle_normals) {  // towards the outside
    const auto& f = of.mesh->triangles[hit.triangle];
    const Vec3& a = of.mesh->vertices[f[0]];
    const Vec3 u = of.mesh->vertices[f[1]] - a, v = of.mesh->vertices[f[2]] - a;
    const Vec3 m = cross(u, v);
    n = (dot(m, n) < 0 ? -1 : 1) / std::sqrt(dot(m, m)) * m;
  }
  q = {{float(place.x), float(place.y), float(place.z)}, {float(-n.x), float(-n.y), float(-n.z)}};
  return hit.triangle;
}

}  // namespace

Result<Candidates> sample_zero_set(const FieldData& field, const Demand& demand, Pulse& pulse) {
  const Layer layer(field, demand);
  const auto each = [&](const auto& body) {
    sched::parallel_for(layer.bricks(), demand.threads, [&](std::size_t row) {
      if (pulse.alive()) body(row);
    });
    return pulse.alive();
  };
  constexpr double pilot = 2;  // darts per cell
  const double thickness = layer_high - layer_low;
  std::vector<std::size_t> hits(layer.bricks(), 0);
  if (!each([&](std::size_t row) { hits[row] = layer.throw_darts(row, pilot, nullptr); }))
    return Failure{"cancelled"};
  double sum = 0;
  for (const std::size_t n : hits) sum += double(n);
  if (sum == 0) {
    return Failure{"The field of this mesh has no surface: ask for more voxels, or an offset."};
  }
  Candidates out;
  out.area = sum / (pilot * thickness);
  const Result<double> wanted = demand.wanted(out.area);
  if (!wanted) return wanted.failure();
  double rate = candidates_for(*wanted, demand.by_spacing()) / (out.area * thickness);
  for (int round = 0; round < 4; ++round, rate *= 4) {
    std::vector<BrickPart> parts(layer.bricks());
    if (!each([&](std::size_t row) { layer.throw_darts(row, rate, &parts[row]); }))
      return Failure{"cancelled"};
    std::vector<std::size_t> first(parts.size() + 1, 0);
    for (std::size_t s = 0; s < parts.size(); ++s) first[s + 1] = first[s] + parts[s].points.size();
    out.points.resize(first.back());
    if (!each([&](std::size_t s) {
          std::copy(parts[s].points.begin(), parts[s].points.end(), out.points.begin() + first[s]);
          parts[s] = {};
        }))
      return Failure{"cancelled"};
    if (demand.by_spacing() || double(out.points.size()) >= 2 * *wanted) break;
  }
  if (out.points.empty() || (!demand.by_spacing() && out.points.size() < demand.points)) {
    return Failure{
        "The surface is too small for this shell: ask for fewer points, or more voxels."};
  }
  return out;
}

void settle(const ZeroSet& of, unsigned threads, Pulse& pulse, Candidates& candidates) {
  constexpr std::size_t slice = 256;
  const std::size_t count = candidates.points.size();
  candidates.source.resize(count);
  sched::parallel_for((count + slice - 1) / slice, threads, [&](std::size_t s) {
    if (!pulse.alive()) return;
    for (std::size_t i = s * slice; i < std::min(count, (s + 1) * slice); ++i) {
      candidates.source[i] = settle(of, candidates.points[i]);
    }
  });
}

}  // namespace h6::io
