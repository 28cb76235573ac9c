// SPDX-License-Identifier: Apache-2.0
#include "io/bake/winding.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include "io/bake/tree.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr std::uint32_t kFan = 8;

Vec3 doubles(const float (&v)[3]) { return {double(v[0]), double(v[1]), double(v[2])}; }

// The error of a dipole grows with its area and falls with the fourth power of the distance. So a
// cluster of little area for its radius, such as slivers, counts as far from nearer by than a disc.
kernels::WindingCluster cluster_of(const Vec3& middle, double radius, double area,
                                   const Vec3& dipole) {
  constexpr double kDisc = 2.4, kLeast = 1.3;  // radii
  const double share = area / (std::numbers::pi * radius * radius);
  const double reach = radius * std::clamp(kDisc * std::sqrt(std::sqrt(share)), kLeast, kDisc);
  return {{float(middle.x), float(middle.y), float(middle.z)},
          float(reach),
          {float(dipole.x), float(dipole.y), float(dipole.z)}};
}

}  // namespace

Winding::Winding(const Surface& surface, unsigned threads)
    : surface_(surface),
      count_(surface.triangles.size()),
      triangle_(order_for_leaves(surface, threads)) {
  cluster_.resize((count_ + kFan - 1) / kFan);
  level_ = {0, std::uint32_t(cluster_.size())};
  std::vector<double> radius_of(cluster_.size()), area_of(cluster_.size());
  sched::parallel_for(cluster_.size(), threads, [&](std::size_t i) {
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
    cluster_[i] = cluster_of(middle, radius, area, (0.25 / std::numbers::pi) * normal);
    radius_of[i] = radius, area_of[i] = area;
  });
  while (level_.back() - level_[level_.size() - 2] > 1) {
    const std::size_t begin = level_[level_.size() - 2], stop = level_.back();
    for (std::size_t first = begin; first < stop; first += kFan) {
      const std::size_t end = std::min(stop, first + kFan);
      Vec3 middle{}, dipole{};
      double area = 0;
      for (std::size_t k = first; k < end; ++k) {
        middle = middle + area_of[k] * doubles(cluster_[k].middle);
        dipole = dipole + doubles(cluster_[k].dipole);
        area += area_of[k];
      }
      middle = (1 / area) * middle;
      double radius = 0;
      for (std::size_t k = first; k < end; ++k)
        radius = std::max(radius, norm(doubles(cluster_[k].middle) - middle) + radius_of[k]);
      cluster_.push_back(cluster_of(middle, radius, area, dipole));
      radius_of.push_back(radius), area_of.push_back(area);
    }
    level_.push_back(std::uint32_t(cluster_.size()));
  }
  make_leaves();
  look_at_surface();
}

void Winding::make_leaves() {
  leaf_.resize((count_ + kFan - 1) / kFan);
  for (std::size_t i = 0; i < leaf_.size(); ++i) {
    Leaf& leaf = leaf_[i];
    const std::size_t end = std::min(count_, kFan * (i + 1));
    const Vec3 origin = surface_.vertices[surface_.triangles[triangle_[kFan * i]][0]];
    for (int k = 0; k < 3; ++k) leaf.origin[k] = std::floor(component(origin, k));
    std::uint32_t known[3 * kFan];
    std::size_t corners = 0;
    for (std::size_t k = kFan * i; k < end; ++k)
      for (const std::uint32_t v : surface_.triangles[triangle_[k]]) {
        const std::uint32_t* at = std::find(known, known + leaf.vertices, v);
        leaf.corner[corners++] = std::uint8_t(at - known);
        if (at != known + leaf.vertices) continue;
        const Vec3& p = surface_.vertices[v];
        leaf.x[leaf.vertices] = float(p.x - leaf.origin[0]);
        leaf.y[leaf.vertices] = float(p.y - leaf.origin[1]);
        leaf.z[leaf.vertices] = float(p.z - leaf.origin[2]);
        known[leaf.vertices++] = v;
      }
    leaf.triangles = std::uint32_t(end - kFan * i);
  }
}

Winding::Places Winding::box(int stride) {
  const double s = stride;
  Places places{{}, {1.5 * s, 0.5 * s, 0.5 * s}, s * std::sqrt(1.5 * 1.5 + 0.5)};
  for (std::size_t i = 0; i < kernels::kWindingPlaces; ++i) {
    places.offsets.x[i] = float(s * double(i % 4));
    places.offsets.y[i] = float(s * double(i / 4 % 2));
    places.offsets.z[i] = float(s * double(i / 8));
  }
  return places;
}

std::uint32_t Winding::inside(const std::array<int, 3>& first, int stride) const {
  float number[kernels::kWindingPlaces];
  numbers({double(first[0]), double(first[1]), double(first[2])}, box_[stride - 1], number);
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < kernels::kWindingPlaces; ++i)
    bits |= std::uint32_t(turn_ * double(number[i]) > 0.5) << i;
  return bits;
}

double Winding::at(const Vec3& p) const {
  float number[kernels::kWindingPlaces];
  numbers(p, {{}, {}, 0}, number);
  return double(number[0]);
}

// A cluster that is far from the ball is far from each place in it.
void Winding::numbers(const Vec3& base, const Places& places,
                      float (&number)[kernels::kWindingPlaces]) const {
  struct Entry {
    std::uint32_t level, cluster;
  };
  Entry stack[128];  // seven of each level wait at most
  int depth = 0;
  thread_local std::vector<std::uint32_t> far, near;
  far.clear(), near.clear();
  const Vec3 middle = base + places.middle;
  stack[depth++] = {std::uint32_t(level_.size()) - 2, std::uint32_t(cluster_.size()) - 1};
  while (depth > 0) {
    const Entry e = stack[--depth];
    const Cluster& cluster = cluster_[e.cluster];
    const Vec3 to = doubles(cluster.middle) - middle;
    const double reach = double(cluster.reach) + places.radius;
    if (dot(to, to) > reach * reach) {
      far.push_back(e.cluster);
    } else if (e.level == 0) {
      near.push_back(e.cluster);
    } else {
      const std::uint32_t below = level_[e.level - 1];
      const std::uint32_t first = below + kFan * (e.cluster - level_[e.level]);
      const std::uint32_t end = std::min(level_[e.level], first + kFan);
      for (std::uint32_t k = first; k < end; ++k) stack[depth++] = {e.level - 1, k};
    }
  }
  const double at[3] = {base.x, base.y, base.z};
  kernels::winding_numbers(cluster_.data(), far.data(), far.size(), leaf_.data(), near.data(),
                           near.size(), at, places.offsets, number);
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
