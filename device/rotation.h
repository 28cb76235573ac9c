// SPDX-License-Identifier: Apache-2.0
// rotation.h - vectors and quaternions of the devices; private to this folder.
#pragma once
#include <cmath>

#include "hapsix/types.h"

namespace h6::device {

inline h6Vec3 operator+(const h6Vec3& a, const h6Vec3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline h6Vec3 operator-(const h6Vec3& a, const h6Vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline h6Vec3 operator*(double s, const h6Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline h6Vec3 cross(const h6Vec3& a, const h6Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const h6Vec3& v) { return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

inline double dot(const h6Quat& a, const h6Quat& b) {
  return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}
inline h6Quat product(const h6Quat& a, const h6Quat& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
inline h6Quat unit(const h6Quat& q) {
  const double n = std::sqrt(dot(q, q));
  return {q.w / n, q.x / n, q.y / n, q.z / n};
}
inline h6Vec3 rotate(const h6Quat& q, const h6Vec3& v) {
  const h6Vec3 u{q.x, q.y, q.z}, t = 2.0 * cross(u, v);
  return v + q.w * t + cross(u, t);
}

// The rotation vector from a to b, world frame, angle in [0, pi].
inline h6Vec3 turn(const h6Quat& from, const h6Quat& to) {
  h6Quat d = product(to, {from.w, -from.x, -from.y, -from.z});
  if (d.w < 0) d = {-d.w, -d.x, -d.y, -d.z};
  const double n = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
  const double scale = n < 1e-9 ? 2 : 2 * std::atan2(n, d.w) / n;
  return {scale * d.x, scale * d.y, scale * d.z};
}

// q, turned by the rotation vector w in the world frame.
inline h6Quat turned(const h6Quat& q, const h6Vec3& w) {
  const double angle = norm(w);
  const double s = angle < 1e-6 ? 0.5 : std::sin(0.5 * angle) / angle;
  return unit(product({std::cos(0.5 * angle), s * w.x, s * w.y, s * w.z}, q));
}

}  // namespace h6::device
