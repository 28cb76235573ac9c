// SPDX-License-Identifier: Apache-2.0
// math.h - Eigen inside the engine, with fixed sizes only, so that nothing allocates.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "hapsix/types.h"

namespace h6 {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

inline Vec3 from(const h6Vec3& v) { return {v.x, v.y, v.z}; }
inline Quat from(const h6Quat& q) { return {q.w, q.x, q.y, q.z}; }
inline h6Vec3 to(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline h6Quat to(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

// Sets m to zero, half by half: GCC fills a whole matrix with a string instruction, which takes
// some 40 cycles to begin.
inline void clear(Mat6& m) {
  m.topRows<3>().setZero();
  m.bottomRows<3>().setZero();
}

// [v]x: the matrix with [v]x w = v x w.
inline Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Rotation vector -> rotation.
inline Quat exp_rotation(const Vec3& w) {
  const double angle = w.norm();
  // sin(a/2)/a by its series, where the quotient would lose digits.
  const double s = angle < 1e-4 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  return Quat(std::cos(0.5 * angle), s * w.x(), s * w.y(), s * w.z());
}

// Rotation -> rotation vector, angle in [0, pi].
inline Vec3 log_rotation(Quat q) {
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double n = q.vec().norm();
  const double scale = n < 1e-8 ? 2.0 / q.w() : 2.0 * std::atan2(n, q.w()) / n;
  return scale * q.vec();
}

// Inverse right Jacobian of the rotation logarithm: log(exp(theta) exp(d)) = theta + J_r^-1 d + ...
inline Mat3 right_jacobian_inverse(const Vec3& theta) {
  const double a = theta.norm();
  const Mat3 k = cross_matrix(theta);
  // (1/a^2)(1 - (a/2) cot(a/2)), by its series near 0.
  const double c =
      a < 1e-3 ? 1.0 / 12.0 + a * a / 720.0 : (1.0 - 0.5 * a / std::tan(0.5 * a)) / (a * a);
  return Mat3::Identity() + 0.5 * k + c * k * k;
}

inline bool finite(const h6Pose& pose) {
  return from(pose.p).allFinite() && from(pose.q).coeffs().allFinite();
}
inline bool finite(const h6Velocity& u) {
  return from(u.linear).allFinite() && from(u.angular).allFinite();
}
inline bool finite(const h6Wrench& f) {
  return from(f.force).allFinite() && from(f.torque).allFinite();
}
// What comes from outside stays within this [m, m/s, rad/s, N, N m], so that nothing overflows.
inline constexpr double kMost = 1e6;
inline bool within(const h6Vec3& v, double most = kMost) {
  return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;
}
// Both are within bounds, and the quaternion can be normalised.
inline bool usable(const h6Pose& pose, const h6Velocity& u) {
  const double n = from(pose.q).norm();
  return within(pose.p) && within(u.linear) && within(u.angular) && n > 0.5 && n < 2.0;
}
inline bool usable(const h6Wrench& f) { return within(f.force) && within(f.torque); }

}  // namespace h6
