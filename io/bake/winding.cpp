// SPDX-License-Identifier: Apache-2.0
#include "io/bake/winding.h"

#include <numbers>

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
  look_at_surface();
}

// Half the solid angle of the triangle turns the sum (A. van Oosterom, J. Strackee, "The solid
// angle of a plane triangle", 1983). It is less than half a turn, so the side of the real axis
// before and after tells a full turn, and one arc tangent serves all triangles.
void Winding::turn(std::uint32_t triangle, const Vec3& p, Turns& sum) const {
  const auto& t = surface_.triangles[triangle];
  const Vec3 a = surface_.vertices[t[0]] - p, b = surface_.vertices[t[1]] - p,
             c = surface_.vertices[t[2]] - p;
  const double la = norm(a), lb = norm(b), lc = norm(c);
  const double y = dot(a, cross(b, c)),
               x = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  const double length2 = x * x + y * y;
  if (!(length2 > 1e-200)) return;  // p is on the triangle's rim
  const double scale = 1 / std::sqrt(length2);
  const double before = sum.y, cosine = x * scale, sine = y * scale;
  sum.y = sum.x * sine + before * cosine;
  sum.x = sum.x * cosine - before * sine;
  if (y >= 0)
    sum.full += before >= 0 && sum.y < 0;
  else
    sum.full -= before < 0 && sum.y >= 0;
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
    const std::size_t first = kFan * e.cluster;
    if (e.level == 0) {
      for (std::size_t k = first; k < std::min(count_, first + kFan); ++k)
        turn(triangle_[k], p, turns);
      continue;
    }
    const std::size_t end = std::min(level_[e.level - 1].size(), first + kFan);
    for (std::size_t k = first; k < end; ++k) stack[depth++] = {e.level - 1, std::uint32_t(k)};
  }
  return sum + turns.full + std::atan2(turns.y, turns.x) / (2 * std::numbers::pi);
}

void Winding::look_at_surface() {
  constexpr std::size_t kLooks = 200;
  constexpr double kNear = 0.2, kMost = 0.8;
  const std::size_t stride = std::max<std::size_t>(1, count_ / kLooks);
  std::size_t looks = 0, outwards = 0, inwards = 0;
  for (std::size_t i = stride / 2; i < count_; i += stride) {
    const auto& t = surface_.triangles[triangle_[i]];
    const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]],
               &c = surface_.vertices[t[2]];
    const Vec3 n = cross(b - a, c - a), m = (1.0 / 3) * (a + b + c), step = (0.5 / norm(n)) * n;
    const double before = at(m + step), behind = at(m - step);
    ++looks;
    const double nearest = std::round(before);
    if (std::fabs(before - nearest) > kNear || std::fabs(behind - std::round(behind)) > kNear)
      continue;
    outwards += nearest >= 0 && std::round(behind) >= nearest;
    inwards += nearest <= 0 && std::round(behind) <= 0;
  }
  turn_ = inwards > outwards ? -1 : 1;
  trusted_ = double(std::max(outwards, inwards)) >= kMost * double(looks) && looks > 0;
}

}  // namespace h6::io::bake
