// SPDX-License-Identifier: Apache-2.0
// vector.h - small vector algebra on h6Vec3 and h6Quat. C++ only, standard headers only.
//
// Components are doubles in whatever unit and frame the caller's vectors share. A quaternion is
// (w, x, y, z) and unit where it stands for a rotation; q and -q are the same rotation. A rotation
// vector is the unit axis times the angle [rad], in the world frame. Sums run from x to z and from
// w to z, and no operation is fused: the same input gives the same bits everywhere.
//
// The types are C's and live in the global namespace, these functions in h6: code outside of h6
// needs `using namespace h6`, and a scope that declares an operator of its own `using h6::operator*`.
#pragma once
#include <algorithm>
#include <cmath>

#include "hapsix/types.h"

namespace h6 {

// ---- vectors -----------------------------------------------------------------------------------

inline h6Vec3 operator+(const h6Vec3& a, const h6Vec3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline h6Vec3 operator-(const h6Vec3& a, const h6Vec3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline h6Vec3 operator-(const h6Vec3& a) { return {-a.x, -a.y, -a.z}; }
inline h6Vec3 operator*(double s, const h6Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }

inline double dot(const h6Vec3& a, const h6Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline h6Vec3 cross(const h6Vec3& a, const h6Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double norm(const h6Vec3& a) { return std::sqrt(dot(a, a)); }
inline h6Vec3 unit(const h6Vec3& a) { return (1 / norm(a)) * a; }  // a is not 0
inline h6Vec3 at_most(const h6Vec3& a, double limit) {  // shortened where it is longer
  const double n = norm(a);
  return n > limit ? (limit / n) * a : a;
}

// Component by component: the corners of boxes.
inline h6Vec3 min(const h6Vec3& a, const h6Vec3& b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
inline h6Vec3 max(const h6Vec3& a, const h6Vec3& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
inline double component(const h6Vec3& a, int axis) {  // axis 0, 1 or 2
  return axis == 0 ? a.x : axis == 1 ? a.y : a.z;
}

// ---- rotations ---------------------------------------------------------------------------------

inline h6Quat operator-(const h6Quat& q) { return {-q.w, -q.x, -q.y, -q.z}; }
inline double dot(const h6Quat& a, const h6Quat& b) {
  return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
}
inline h6Quat conjugate(const h6Quat& q) { return {q.w, -q.x, -q.y, -q.z}; }
inline h6Quat product(const h6Quat& a, const h6Quat& b) {  // b first, then a
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}
inline h6Quat unit(const h6Quat& q) {  // q is not 0
  const double n = std::sqrt(dot(q, q));
  return {q.w / n, q.x / n, q.y / n, q.z / n};
}

// v turned by q: q v q*.
inline h6Vec3 rotate(const h6Quat& q, const h6Vec3& v) {
  const h6Vec3 u = {q.x, q.y, q.z}, t = 2 * cross(u, v);
  return v + q.w * t + cross(u, t);
}
// A point of a body, given in the body's frame [m], in the world.
inline h6Vec3 place(const h6Pose& pose, const h6Vec3& point) {
  const h6Vec3 u = {pose.q.x, pose.q.y, pose.q.z}, t = 2 * cross(u, point);
  return pose.p + point + pose.q.w * t + cross(u, t);
}

// The rotation by the rotation vector w.
inline h6Quat turn_by(const h6Vec3& w) {
  const double angle = norm(w);
  const double s = angle < 1e-6 ? 0.5 : std::sin(0.5 * angle) / angle;
  return {std::cos(0.5 * angle), s * w.x, s * w.y, s * w.z};
}
// q, turned further by the rotation vector w; unit again.
inline h6Quat turned(const h6Quat& q, const h6Vec3& w) { return unit(product(turn_by(w), q)); }
// The rotation vector that turns `from` into `to`, its angle in [0, pi].
inline h6Vec3 turn(const h6Quat& from, const h6Quat& to) {
  h6Quat d = product(to, conjugate(from));
  if (d.w < 0) d = -d;
  const h6Vec3 v = {d.x, d.y, d.z};
  const double n = norm(v);
  return (n < 1e-9 ? 2 : 2 * std::atan2(n, d.w) / n) * v;
}

}  // namespace h6
