// SPDX-License-Identifier: Apache-2.0
// hand_filter.h - indexing and scaling between a device and the scene. METHOD.md, Sec. 4.
//
// Motion is scaled about the body's centre of mass x, where the hand holds it:
//     x_m = X_m + s (x - X),     q_m = exp(s_r log(q Q^-1)) Q_m
// with anchors (X, Q) at the device and (X_m, Q_m) in the scene. So a turn of the device about that
// point stays a turn about it. Torques are about it too, so that force scaled like motion keeps
// power.
#pragma once
#include <algorithm>

#include "hapsix/device.h"
#include "runtime/base/math.h"

namespace h6 {

// One direction of the map. The rotation's anchor follows a hand that turns far, so that it never
// reaches half a turn, where the logarithm would flip. METHOD.md says what that costs.
class ScaledMotion {
 public:
  ScaledMotion() = default;
  ScaledMotion(double scale, double rotation_scale, const Vec3& com)
      : scale_(scale), rotation_scale_(rotation_scale), com_(com) {}
  // From now on `in` is mapped to `out`, bit for bit.
  void anchor(const h6Pose& in, const h6Pose& out);
  // A pose with the bits of the last one is mapped to the bits of the last result.
  h6BodyState map(const h6BodyState& in);

 private:
  bool identity() const;  // the map changes no bit
  double scale_ = 1, rotation_scale_ = 1;
  Vec3 com_ = Vec3::Zero();                          // mesh frame [m]
  Vec3 x_in_ = Vec3::Zero(), x_out_ = Vec3::Zero();  // anchors of the centre of mass
  Quat q_in_ = Quat::Identity(), q_out_ = Quat::Identity();
  h6Pose last_in_{{0, 0, 0}, {1, 0, 0, 0}}, last_out_{{0, 0, 0}, {1, 0, 0, 0}};
};

class HandFilter {
 public:
  // `admittance`: of either kind; poses then go from the scene to the device. com: in the mesh
  // frame [m].
  void set(const h6HandFilterDef& def, const Vec3& com, bool admittance);

  // Maps a finite sample of the device to the scene. `scene` is the present pose of the body, or of
  // the manipulandum in pseudo-admittance: the first sample of a relative hand is mapped there, and
  // in the admittance modes also the first after the clutch. While the clutch is down the pose
  // stays, and velocity and wrench are zero.
  h6DeviceSample to_scene(const h6DeviceSample& device, const h6Pose& scene, bool* clutched);
  bool clutched() const { return clutched_; }

  h6Wrench to_device(const h6Wrench& felt) const;
  // Admittance modes. While the clutch is down the device gets its own motion back.
  h6BodyState to_device(const h6BodyState& scene);

  double force_scale() const { return def_.force_scale; }
  // Power at the device over power in the scene: the larger ratio of translation and rotation.
  double power_scale() const {
    return def_.force_scale / std::min(def_.motion_scale, def_.rotation_scale);
  }
  // The last good sample, as the device gave it.
  const h6DeviceSample& device() const { return device_; }

 private:
  void anchor(const h6Pose& device, const h6Pose& scene);
  h6HandFilterDef def_{1, 1, 1, 0, false, {}};
  bool admittance_ = false, started_ = false, clutched_ = false;
  ScaledMotion to_scene_, to_device_;
  h6DeviceSample device_{{{0, 0, 0}, {1, 0, 0, 0}}, {}, 0, {}, 0, {}};
  h6Pose held_{{0, 0, 0}, {1, 0, 0, 0}};  // last pose in the scene
};

}  // namespace h6
