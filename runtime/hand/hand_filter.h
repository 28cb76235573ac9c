// SPDX-License-Identifier: Apache-2.0
// hand_filter.h - indexing and scaling between a device and the scene. METHOD.md, Sec. 4.
//
// The centre of mass is what is scaled about: with x the body's centre of mass where the hand holds
// it,
//     x_m = X_m + s (x - X),     q_m = exp(s_r log(q Q^-1)) Q_m
// (X, Q) and (X_m, Q_m) being anchors at the device and in the scene. A turn of the device about
// that point so stays a turn about it, and as torques are about it too, scaling force like motion
// keeps power.
#pragma once
#include <algorithm>

#include "hapsix/device.h"
#include "runtime/base/math.h"

namespace h6 {

// One direction of the map. The rotation's anchor follows when the hand turns far: half a turn is
// then never reached, where a logarithm would flip; METHOD.md says what that costs.
class ScaledMotion {
 public:
  ScaledMotion() = default;
  ScaledMotion(double scale, double rotation_scale, const Vec3& com)
      : scale_(scale), rotation_scale_(rotation_scale), com_(com) {}
  // `in` goes to `out` from now on, to the bit.
  void anchor(const h6Pose& in, const h6Pose& out);
  // A pose that is the last one to the bit goes to the last one's image to the bit.
  h6BodyState map(const h6BodyState& in);

 private:
  bool identity() const;  // nothing to do, to the bit
  double scale_ = 1, rotation_scale_ = 1;
  Vec3 com_ = Vec3::Zero();                          // mesh frame [m]
  Vec3 x_in_ = Vec3::Zero(), x_out_ = Vec3::Zero();  // anchors of the centre of mass
  Quat q_in_ = Quat::Identity(), q_out_ = Quat::Identity();
  h6Pose last_in_{{0, 0, 0}, {1, 0, 0, 0}}, last_out_{{0, 0, 0}, {1, 0, 0, 0}};
};

class HandFilter {
 public:
  // `admittance`: of either kind; poses then go from the scene to the device. com: mesh frame [m].
  void set(const h6HandFilterDef& def, const Vec3& com, bool admittance);

  // A finite sample of the device as the scene sees it. `scene`: where that which follows the hand
  // is now (the body, or a pseudo-admittance manipulandum): the first sample of a relative hand
  // and, in the admittance modes, the release of the clutch take it there. While the clutch is
  // down the pose stays, velocity and wrench are zero.
  h6DeviceSample to_scene(const h6DeviceSample& device, const h6Pose& scene, bool* clutched);
  bool clutched() const { return clutched_; }

  h6Wrench to_device(const h6Wrench& felt) const;
  // Admittance modes. While the clutch is down the device is told what it does by itself.
  h6BodyState to_device(const h6BodyState& scene);

  double force_scale() const { return def_.force_scale; }
  // Power at the device over power in the scene; the larger of translation's and rotation's.
  double power_scale() const {
    return def_.force_scale / std::min(def_.motion_scale, def_.rotation_scale);
  }
  // The last good sample as the device gave it.
  const h6DeviceSample& device() const { return device_; }

 private:
  void anchor(const h6Pose& device, const h6Pose& scene);
  h6HandFilterDef def_{1, 1, 1, 0, false};
  bool admittance_ = false, started_ = false, clutched_ = false;
  ScaledMotion to_scene_, to_device_;
  h6DeviceSample device_{{{0, 0, 0}, {1, 0, 0, 0}}, {}, 0, {}, 0};
  h6Pose held_{{0, 0, 0}, {1, 0, 0, 0}};  // last pose in the scene
};

}  // namespace h6
