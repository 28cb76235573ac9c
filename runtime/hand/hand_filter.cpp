// SPDX-License-Identifier: Apache-2.0
// hand_filter.cpp - the scaled maps and the clutch.
#include "runtime/hand/hand_filter.h"

#include <cmath>
#include <cstring>

namespace h6 {
namespace {

// A rotation farther than this from its anchor moves the anchor [rad]. Two samples may then be
// nearly half a turn apart before the logarithm is ambiguous.
constexpr double kLeash = 2.0;

bool same(const h6Pose& a, const h6Pose& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

// d exp(theta) = [left(theta) d theta]x exp(theta): rates of a rotation vector -> angular velocity.
Mat3 left_jacobian(const Vec3& theta) {
  const double a = theta.norm();
  const Mat3 k = cross_matrix(theta);
  // (1 - cos a)/a^2 and (a - sin a)/a^3, by their series near 0.
  const double b = a < 1e-2 ? 0.5 - a * a / 24.0 : (1 - std::cos(a)) / (a * a);
  const double c = a < 1e-2 ? 1.0 / 6.0 - a * a / 120.0 : (a - std::sin(a)) / (a * a * a);
  return Mat3::Identity() + b * k + c * k * k;
}

h6Wrench scaled(const h6Wrench& w, double s) {
  return {{w.force.x * s, w.force.y * s, w.force.z * s},
          {w.torque.x * s, w.torque.y * s, w.torque.z * s}};
}

}  // namespace

void ScaledMotion::anchor(const h6Pose& in, const h6Pose& out) {
  last_in_ = in;
  last_out_ = out;
  q_in_ = from(in.q);
  q_out_ = from(out.q);
  x_in_ = from(in.p) + q_in_ * com_;
  x_out_ = from(out.p) + q_out_ * com_;
}

bool ScaledMotion::identity() const {
  return scale_ == 1 && rotation_scale_ == 1 && x_in_ == x_out_ &&
         q_in_.coeffs() == q_out_.coeffs();
}

h6BodyState ScaledMotion::map(const h6BodyState& in) {
  if (identity()) {
    last_in_ = last_out_ = in.pose;
    return in;
  }
  const Quat q = from(in.pose.q);
  Vec3 theta = log_rotation(q * q_in_.conjugate());
  if (theta.norm() > kLeash) {
    // The last sample becomes the anchor; its image stays, so nothing jumps.
    q_in_ = from(last_in_.q);
    q_out_ = from(last_out_.q);
    theta = log_rotation(q * q_in_.conjugate());
  }
  const Vec3 turned = rotation_scale_ * theta, arm = q * com_;
  const Quat q_out = (exp_rotation(turned) * q_out_).normalized();
  const Vec3 x_out = x_out_ + scale_ * (from(in.pose.p) + arm - x_in_), arm_out = q_out * com_;

  const Vec3 w = from(in.velocity.angular);
  // The rate of theta is left(theta)^-1 w, and left(theta)^-1 = right(-theta)^-1.
  const Vec3 w_out =
      left_jacobian(turned) * (rotation_scale_ * (right_jacobian_inverse(Vec3(-theta)) * w));
  const Vec3 v_out = scale_ * (from(in.velocity.linear) + w.cross(arm)) - w_out.cross(arm_out);
  h6BodyState out{{to(Vec3(x_out - arm_out)), to(q_out)}, {to(v_out), to(w_out)}};
  if (same(in.pose, last_in_)) out.pose = last_out_;
  last_in_ = in.pose;
  last_out_ = out.pose;
  return out;
}

void HandFilter::set(const h6HandFilterDef& def, const Vec3& com, bool admittance) {
  def_ = def;
  admittance_ = admittance;
  started_ = clutched_ = false;
  to_scene_ = ScaledMotion(def.motion_scale, def.rotation_scale, com);
  to_device_ = ScaledMotion(1 / def.motion_scale, 1 / def.rotation_scale, com);
}

void HandFilter::anchor(const h6Pose& device, const h6Pose& scene) {
  to_scene_.anchor(device, scene);
  to_device_.anchor(scene, device);
}

h6DeviceSample HandFilter::to_scene(const h6DeviceSample& device, const h6Pose& scene,
                                    bool* clutched) {
  if (!started_) held_ = def_.relative ? scene : device.pose;
  const bool was = clutched_;
  clutched_ = (device.buttons & def_.clutch_buttons) != 0;
  *clutched = clutched_;
  device_ = device;
  if (clutched_ || was || !started_) {
    // Under the clutch an impedance hand's manipulandum rested; in the other modes the follower may
    // have moved.
    if (started_ && admittance_) held_ = scene;
    anchor(device.pose, held_);
  }
  started_ = true;
  h6DeviceSample out = device;
  if (clutched_) {
    out.pose = held_;
    out.velocity = {};
    out.wrench = {};
    return out;
  }
  const h6BodyState state = to_scene_.map({device.pose, device.velocity});
  out.pose = held_ = state.pose;
  out.velocity = state.velocity;
  if (def_.force_scale != 1) out.wrench = scaled(device.wrench, 1 / def_.force_scale);
  return out;
}

h6Wrench HandFilter::to_device(const h6Wrench& felt) const {
  if (clutched_) return {};
  return def_.force_scale == 1 ? felt : scaled(felt, def_.force_scale);
}

h6BodyState HandFilter::to_device(const h6BodyState& scene) {
  if (clutched_) return {device_.pose, device_.velocity};
  return to_device_.map(scene);
}

}  // namespace h6
