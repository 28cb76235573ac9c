// SPDX-License-Identifier: Apache-2.0
// surface_places.cpp - see surface_places.h.
#include "io/check/surface_places.h"

#include <algorithm>
#include <cmath>

namespace h6::io {
std::uint64_t Dice::next() {
  std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}
double Dice::within(double low, double high) {
  return low + (high - low) * double(next() >> 11) * 0x1p-53;
}
Vec3 Dice::direction() {
  for (;;) {
    const Vec3 d{within(-1, 1), within(-1, 1), within(-1, 1)};
    const double length2 = dot(d, d);
    if (length2 > 1 || length2 < 0.01) continue;
    const double length = std::sqrt(length2);
    return {d.x / length, d.y / length, d.z / length};
  }
}

SurfacePlaces::SurfacePlaces(const Mesh& mesh) : mesh_(mesh) {
  sum_.reserve(mesh.triangles.size());
  double sum = 0;
  for (const auto& f : mesh.triangles) {
    const Vec3& a = mesh.vertices[f[0]];
    const Vec3 n = cross(mesh.vertices[f[1]] - a, mesh.vertices[f[2]] - a);
    sum_.push_back(sum += std::sqrt(dot(n, n)) / 2);
  }
}

SurfacePlaces::SurfacePlaces(const Mesh& mesh, const std::vector<double>& area) : mesh_(mesh) {
  sum_.reserve(area.size());
  double sum = 0;
  for (const double a : area) sum_.push_back(sum += a);
}

SurfacePlaces::Place SurfacePlaces::operator()(Dice& dice) const {
  const auto found = std::upper_bound(sum_.begin(), sum_.end(), dice.within(0, sum_.back()));
  const auto t = std::min(std::size_t(found - sum_.begin()), sum_.size() - 1);
  double u = dice.within(0, 1), v = dice.within(0, 1);
  if (u + v > 1) u = 1 - u, v = 1 - v;
  const auto& f = mesh_.triangles[t];
  const Vec3& a = mesh_.vertices[f[0]];
  const Vec3 b = mesh_.vertices[f[1]] - a, c = mesh_.vertices[f[2]] - a;
  return {std::uint32_t(t),
          {a.x + u * b.x + v * c.x, a.y + u * b.y + v * c.y, a.z + u * b.z + v * c.z}};
}

}  // namespace h6::io
