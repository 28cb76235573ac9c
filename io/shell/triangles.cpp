// SPDX-License-Identifier: Apache-2.0
// triangles.cpp - candidates on the triangles of a mesh, uniform by area, where the outside
// reaches.
#include <algorithm>
#include <cmath>

#include "io/file/mix.h"
#include "io/shell/candidates.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr std::size_t slice_size = 4096;

// A number in [0, 1) from the top bits.
double unit(std::uint64_t bits) { return double(bits >> 11) * 0x1p-53; }

// Running sum of weights (triangles + 1). Candidates fall in proportion to area, but wires and
// slivers get more: area alone leaves holes along a strip far narrower than the spacing. `spacing`
// may be rough [m].
std::vector<double> weigh(const Mesh& mesh, const FaceTable& faces, double spacing) {
  const std::size_t count = mesh.triangles.size();
  std::vector<double> sum(count + 1, 0);
  for (std::size_t t = 0; t < count; ++t) {
    const double area = faces.area[t];
    double longest2 = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = mesh.vertices[mesh.triangles[t][k]],
                 &b = mesh.vertices[mesh.triangles[t][(k + 1) % 3]];
      longest2 = std::max(longest2, dot(a - b, a - b));
    }
    const double longest = std::sqrt(longest2);
    double weight = area;
    if (area > 0 && longest > spacing) {
      const double width = 2 * area / longest;
      weight *= std::clamp(0.5 * spacing / width, 1.0, 8.0);
    }
    sum[t + 1] = sum[t] + weight;
  }
  return sum;
}

// Calls take(slice, i, triangle, place) for all candidates, slices in parallel. Candidate i lies in
// the i-th of `count` equal parts of the running weight; its place in the triangle follows the R2
// sequence (additive recurrence with the plastic number). So candidates are even in large triangles
// and over many small ones, and each depends on i alone, not on threads.
template <class Take>
void scatter(const Mesh& mesh, const FaceTable& faces, const std::vector<double>& weights,
             std::size_t count, const Demand& demand, Pulse& pulse, const Take& take) {
  const double step = weights.back() / double(count);
  const std::uint64_t start_u = mix(demand.seed, 1), start_v = mix(demand.seed, 2);
  const auto body = [&](std::size_t s) {
    if (!pulse.alive()) return;
    const std::size_t from = s * slice_size, to = std::min(count, from + slice_size);
    const auto first = std::upper_bound(weights.begin(), weights.end(), double(from) * step);
    std::size_t t = std::size_t(std::max<std::ptrdiff_t>(first - weights.begin() - 1, 0));
    for (std::size_t i = from; i < to; ++i) {
      const double at = (double(i) + unit(mix(demand.seed ^ 0xA5A5, i))) * step;
      while (t + 1 < mesh.triangles.size() && weights[t + 1] <= at) ++t;
      while (faces.area[t] == 0) --t;  // rounding at the very end
      double u = unit(start_u + i * 0xC13FA9A902A6328Fu),
             v = unit(start_v + i * 0x91E10DA5C79E7B1Du);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto& f = mesh.triangles[t];
      const Vec3 &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
      take(s, i, t,
           Vec3{a.x + u * (b.x - a.x) + v * (c.x - a.x), a.y + u * (b.y - a.y) + v * (c.y - a.y),
                a.z + u * (b.z - a.z) + v * (c.z - a.z)});
    }
  };
  sched::parallel_for((count + slice_size - 1) / slice_size, demand.threads, body);
}

OrientedPoint oriented(const Vec3& p, const Vec3& n, double sign) {
  return {{float(p.x), float(p.y), float(p.z)},
          {float(sign * n.x), float(sign * n.y), float(sign * n.z)}};
}

// So many voxels outside the field's zero set, in its grid.
Vec3 look(const Reach& reach, const Vec3& place, const Vec3& out, double voxels) {
  return reach.field->from_metres(place) + (reach.offset + voxels) * out;
}

// Decides which sides of the surface are reached.
class Judge {
 public:
  Judge(const FaceTable& faces, const Reach& reach) : faces_(faces), reach_(reach) {}

  // Appends the sides of a candidate that are reached and returns how many they are.
  int operator()(std::size_t t, const Vec3& place, RawVector<OrientedPoint>& out_points) const {
    const Vec3& n = faces_.inward[t];
    int sides = 0;
    for (const double sign : {1.0, -1.0}) {  // of the inward normal
      if (sign < 0 && !faces_.sheet[t]) continue;
      const Vec3 out{-sign * n.x, -sign * n.y, -sign * n.z};
      if (reach_.hide && !reached(reach_, place, out)) continue;
      ++sides;
      Vec3 slope{};
      const bool smooth = reach_.field_normals && outward(place, out, slope);
      out_points.push_back(oriented(place, smooth ? slope : out, -1));
    }
    return sides;
  }

 private:
  // The field's slope a little outside, by differences over two whole voxels: the error of
  // trilinear values is the same at both ends.
  bool outward(const Vec3& place, const Vec3& out, Vec3& slope) const {
    const Vec3 at = look(reach_, place, out, 1.1);
    double d[6];
    for (int k = 0; k < 6; ++k) {
      const double step = k % 2 ? -1 : 1;
      const Vec3 to{at.x + (k / 2 == 0) * step, at.y + (k / 2 == 1) * step,
                    at.z + (k / 2 == 2) * step};
      if (!reach_.field->distance(to, d[k])) return false;
    }
    slope = {d[0] - d[1], d[2] - d[3], d[4] - d[5]};
    const double length = norm(slope);
    if (!(length > 1)) return false;  // 2 is exact; less than half: between walls face to face
    slope = {slope.x / length, slope.y / length, slope.z / length};
    return true;
  }

  const FaceTable& faces_;
  const Reach& reach_;
};

struct Part {  // the candidates of one slice
  RawVector<OrientedPoint> points;
  RawVector<std::uint32_t> source;
  std::size_t hidden = 0;
};

std::vector<Part> judge_all(const Mesh& mesh, const FaceTable& faces, const Reach& reach,
                            const std::vector<double>& weights, std::size_t count,
                            const Demand& demand, Pulse& pulse) {
  std::vector<Part> parts((count + slice_size - 1) / slice_size);
  const Judge judge(faces, reach);
  scatter(mesh, faces, weights, count, demand, pulse,
          [&](std::size_t s, std::size_t, std::size_t t, const Vec3& place) {
            const int sides = judge(t, place, parts[s].points);
            for (int k = 0; k < sides; ++k) parts[s].source.push_back(std::uint32_t(t));
            parts[s].hidden += sides == 0;
          });
  return parts;
}

void join(std::vector<Part>& parts, const Demand& demand, Candidates& out) {
  std::vector<std::size_t> first(parts.size() + 1, 0);
  for (std::size_t s = 0; s < parts.size(); ++s) first[s + 1] = first[s] + parts[s].points.size();
  out.points.resize(first.back());
  out.source.resize(first.back());
  sched::parallel_for(parts.size(), demand.threads, [&](std::size_t s) {
    std::copy(parts[s].points.begin(), parts[s].points.end(), out.points.begin() + first[s]);
    std::copy(parts[s].source.begin(), parts[s].source.end(), out.source.begin() + first[s]);
    parts[s] = {};
  });
}

}  // namespace

// A side is reached if the field is clearly positive half a voxel outside its zero set. So walls of
// gaps that the zero set does not enter are not reached.
bool reached(const Reach& reach, const Vec3& place, const Vec3& out) {
  double d = 0;
  return reach.field->distance(look(reach, place, out, 0.5), d) && d > 0.25;
}

Result<Candidates> sample_triangles(const Mesh& mesh, const FaceTable& faces, const Reach& reach,
                                    const Demand& demand, Pulse& pulse) {
  Candidates out;
  double area = 0;
  for (const double a : faces.area) area += a;
  double share = 1;  // reached sides per candidate
  if (reach.field) {
    constexpr std::size_t pilot = 65536;
    const std::vector<double> weights = weigh(mesh, faces, INFINITY);
    std::size_t kept = 0, hidden = 0;
    for (const Part& part : judge_all(mesh, faces, reach, weights, pilot, demand, pulse)) {
      kept += part.points.size();
      hidden += part.hidden;
    }
    if (!pulse.alive()) return Failure{"cancelled"};
    if (kept == 0) {
      return Failure{
          "Nothing of this mesh can be reached from outside at this voxel size: ask for more "
          "voxels, or a smaller offset."};
    }
    share = double(kept) / double(pilot);
    out.hidden = double(hidden) / double(pilot);
  }
  out.area = share * area;
  const Result<double> wanted = demand.wanted(out.area);
  if (!wanted) return wanted.failure();
  const std::vector<double> weights = weigh(mesh, faces, demand.guess(out.area, *wanted));
  const double boost = std::min(weights.back() / area, 3.0) / std::max(share, 0.02);
  auto count = std::size_t(candidates_for(*wanted, demand.by_spacing()) * boost);
  if (!reach.field) {
    out.points.resize(count);
    out.source.resize(count);
    scatter(mesh, faces, weights, count, demand, pulse,
            [&](std::size_t, std::size_t i, std::size_t t, const Vec3& place) {
              out.points[i] = oriented(place, faces.inward[t], 1);
              out.source[i] = std::uint32_t(t);
            });
  } else {
    for (int round = 0; round < 4; ++round, count *= 4) {
      std::vector<Part> parts = judge_all(mesh, faces, reach, weights, count, demand, pulse);
      if (!pulse.alive()) break;
      join(parts, demand, out);
      if (demand.by_spacing() || double(out.points.size()) >= 2 * *wanted) break;
    }
    if (!demand.by_spacing() && out.points.size() < demand.points && pulse.alive()) {
      return Failure{"Too little of this mesh can be reached from outside for " +
                     std::to_string(demand.points) + " points: ask for fewer, or for more voxels."};
    }
  }
  if (!pulse.alive()) return Failure{"cancelled"};
  return out;
}

}  // namespace h6::io
