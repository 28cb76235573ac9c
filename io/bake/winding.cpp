// SPDX-License-Identifier: Apache-2.0
#include "io/bake/winding.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include "io/bake/tree.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::size_t kFan = 8;
constexpr double kFar = 2;  // radii from which a cluster is a dipole

std::array<float, 3> floats(const Vec3& v) { return {float(v.x), float(v.y), float(v.z)}; }
Vec3 doubles(const std::array<float, 3>& v) { return {double(v[0]), double(v[1]), double(v[2])}; }

}  // namespace

Winding::Winding(const Surface& surface, unsigned threads)
    : surface_(surface),
      count_(surface.triangles.size()),
      triangle_(order_for_leaves(surface, threads)) {
  level_.emplace_back((count_ + kFan - 1) / kFan);
  sched::parallel_for(level_[0].size(), threads, [&](std::size_t i) {
    const std::size_t first = kFan * i, end = std::min(count_, first + kFan);
    Vec3 middle{}, normal{};
    double area = 0;
    for (std::size_t k = first; k < end; ++k) {
      const auto& t = surface_.triangles[triangle_[k]];
      const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
                 &c = surface_.vertices[t[2]];
      const Vec3 n = 0.5 * cross(b - a, c - a);
      normal = normal + n;
      middle = middle + (norm(n) / 3) * (a + b + c);
      area += norm(n);
    }
    middle = (1 / area) * middle;
    double radius = 0;
    for (std::size_t k = first; k < end; ++k)
      for (const std::uint32_t v : surface_.triangles[triangle_[k]])
        radius = std::max(radius, norm(surface_.vertices[v] - middle));
    level_[0][i] = {floats(middle), float(radius), floats((0.25 / std::numbers::pi) * normal)};
  });
  while (level_.back().size() > 1) {
    const std::vector<Cluster>& below = level_.back();
    std::vector<Cluster> above((below.size() + kFan - 1) / kFan);
    for (std::size_t i = 0; i < above.size(); ++i) {
      const std::size_t first = kFan * i, end = std::min(below.size(), first + kFan);
      Vec3 middle{}, dipole{};
      double weight = 0;
      for (std::size_t k = first; k < end; ++k) {
        const double w = double(below[k].radius) * double(below[k].radius) + 1e-12;
        middle = middle + w * doubles(below[k].middle);
        dipole = dipole + doubles(below[k].dipole);
        weight += w;
      }
      middle = (1 / weight) * middle;
      double radius = 0;
      for (std::size_t k = first; k < end; ++k)
        radius =
            std::max(radius, norm(doubles(below[k].middle) - middle) + double(below[k].radius));
      above[i] = {floats(middle), float(radius), floats(dipole)};
    }
    level_.push_back(std::move(above));
  }
  make_leaves();
  look_at_surface();
}

void Winding::make_leaves() {
  leaf_.resize((count_ + kFan - 1) / kFan);
  for (std::size_t i = 0; i < leaf_.size(); ++i) {
    Leaf& leaf = leaf_[i];
    leaf.first = std::uint32_t(leaf_vertex_.size());
    const std::size_t end = std::min(count_, kFan * (i + 1));
    std::uint32_t known[3 * kFan];
    std::size_t corners = 0;
    for (std::size_t k = kFan * i; k < end; ++k)
      for (const std::uint32_t v : surface_.triangles[triangle_[k]]) {
        const std::uint32_t* at = std::find(known, known + leaf.vertices, v);
        leaf.corner[corners++] = std::uint8_t(at - known);
        if (at != known + leaf.vertices) continue;
        known[leaf.vertices++] = v;
        leaf_vertex_.push_back(surface_.vertices[v]);
      }
    leaf.triangles = std::uint32_t(end - kFan * i);
  }
}

// Half the solid angle of each triangle turns the sum (A. van Oosterom, J. Strackee, "The solid
// angle of a plane triangle", 1983). It is less than half a turn, so the side of the real axis
// before and after tells a full turn, and one arc tangent serves all triangles.
void Winding::turn(const Leaf& leaf, const Vec3& p, Turns& sum) const {
  Vec3 to[3 * kFan];
  double length[3 * kFan];
  for (std::uint32_t v = 0; v < leaf.vertices; ++v) {
    to[v] = leaf_vertex_[leaf.first + v] - p;
    length[v] = norm(to[v]);
  }
  for (std::uint32_t t = 0; t < leaf.triangles; ++t) {
    const std::uint8_t* corner = &leaf.corner[3 * t];
    const Vec3 &a = to[corner[0]], &b = to[corner[1]], &c = to[corner[2]];
    const double la = length[corner[0]], lb = length[corner[1]], lc = length[corner[2]];
    double y = dot(a, cross(b, c)),
           x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    const double length2 = x * x + y * y;
    if (!(length2 > 1e-200)) continue;  // p is on the triangle's rim
    if (length2 < 1e-12) {              // eight such factors would leave the range of doubles
      const double scale = 1 / std::sqrt(length2);
      x *= scale, y *= scale;
    }
    const double before = sum.y;
    sum.y = sum.x * y + before * x;
    sum.x = sum.x * x - before * y;
    if (y >= 0)
      sum.full += before >= 0 && sum.y < 0;
    else
      sum.full -= before < 0 && sum.y >= 0;
  }
  const double scale = 1 / std::sqrt(sum.x * sum.x + sum.y * sum.y);
  sum.x *= scale, sum.y *= scale;
}

double Winding::at(const Vec3& p) const {
  struct Entry {
    std::uint32_t level, cluster;
  };
  Entry stack[128];  // seven of each level wait at most
  int depth = 0;
  stack[depth++] = {std::uint32_t(level_.size()) - 1, 0};
  double sum = 0;
  Turns turns;
  while (depth > 0) {
    const Entry e = stack[--depth];
    const Cluster& cluster = level_[e.level][e.cluster];
    const Vec3 to = doubles(cluster.middle) - p;
    const double far2 = dot(to, to), near = kFar * double(cluster.radius);
    if (far2 > near * near) {
      sum += dot(to, doubles(cluster.dipole)) / (far2 * std::sqrt(far2));
      continue;
    }
    if (e.level == 0) {
      turn(leaf_[e.cluster], p, turns);
      continue;
    }
    const std::size_t first = kFan * e.cluster;
    const std::size_t end = std::min(level_[e.level - 1].size(), first + kFan);
    for (std::size_t k = first; k < end; ++k) stack[depth++] = {e.level - 1, std::uint32_t(k)};
  }
  return sum + turns.full + std::atan2(turns.y, turns.x) / (2 * std::numbers::pi);
}

Winding::Look Winding::look(std::uint32_t triangle) const {
  constexpr double kNear = 0.2;
  const auto& t = surface_.triangles[triangle];
  const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
             &c = surface_.vertices[t[2]];
  const Vec3 n = cross(b - a, c - a), m = (1.0 / 3) * (a + b + c), step = (0.5 / norm(n)) * n;
  const double before = at(m + step), behind = at(m - step), nearest = std::round(before);
  if (std::fabs(before - nearest) > kNear || std::fabs(behind - std::round(behind)) > kNear)
    return {};
  return {nearest >= 0 && std::round(behind) >= nearest, nearest <= 0 && std::round(behind) <= 0};
}

void Winding::look_at_surface() {
  constexpr std::size_t kLooks = 200;
  constexpr double kMost = 0.8;
  const std::size_t stride = std::max<std::size_t>(1, count_ / kLooks);
  std::size_t looks = 0, outwards = 0, inwards = 0;
  for (std::size_t i = stride / 2; i < count_; i += stride) {
    const Look l = look(triangle_[i]);
    ++looks;
    outwards += l.outwards;
    inwards += l.inwards;
  }
  turn_ = inwards > outwards ? -1 : 1;
  trusted_ = double(std::max(outwards, inwards)) >= kMost * double(looks) && looks > 0;
}

}  // namespace h6::io::bake
