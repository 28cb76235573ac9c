// SPDX-License-Identifier: Apache-2.0
// body.h - rigid bodies: their state, and the wrench that acts on each in a frame.
#pragma once
#include "runtime/base/math.h"
#include "runtime/model/model.h"

namespace h6 {

// The state of a body's centre of mass, world frame. Poses in the public headers are those of the
// mesh frame.
struct RigidState {
  Vec3 x = Vec3::Zero(), v = Vec3::Zero(), w = Vec3::Zero();
  Quat q = Quat::Identity();
  Mat3 R = Mat3::Identity();  // the rotation matrix of q
};

// How far a body has moved since its session began: sums over its steps.
struct Travelled {
  double shift = 0;  // of its centre of mass [m]
  double turn = 0;   // [rad]
};

// How a body moves from one frame to the next: METHOD.md, Sec. 4.
enum class Motion : std::uint8_t { dynamic, quasi_static, held };

struct Deformation;

struct Body : RigidState {
  bool fixed = true;
  bool translation_only = false;
  Motion motion = Motion::dynamic;
  const Shell* shell = nullptr;  // null: the body touches nothing by itself
  const Field* field = nullptr;  // null: nothing touches the body
  Deformation* bend = nullptr;   // null: the body is rigid
  double mass = 0;               // [kg]
  Vec3 com = Vec3::Zero();       // mesh frame [m]
  Mat3 inertia = Mat3::Zero();   // about com, mesh axes [kg m^2]
  double voxel = 1e-3;           // the smallest voxel of the fields that the body can touch [m]
  double radius = 0;             // distance of the farthest shell point from com [m]
  double max_step = 0;           // quasi-static: the most that a point may move in a frame [m]
  // How much velocity the solver gave a free body in the last frame, before it was slowed down.
  Vec3 gained_v = Vec3::Zero(), gained_w = Vec3::Zero();
  Travelled travelled;
  std::int32_t meets = -1;  // row among the session's shell bodies
  // Quasi-static: the coupling's damping over its stiffness [s], and the velocity of the last step,
  // which this damper sees and contacts do not.
  double lag = 0;
  Vec6 step_rate = Vec6::Zero();
  double drag = 0;  // admittance hands: damping of the free body [N s/m]
};

// A wrench about a body's centre of mass and its derivatives by the body's own pose and velocity,
// world frame: f(dq, du) = f + K dq + D du.
struct LinearWrench {
  Vec6 f;
  Mat6 K, D;
  void set_zero() {
    f.setZero();
    clear(K);
    clear(D);
  }
};

// The pose and velocity of the body's mesh frame, when its centre of mass has `state`.
inline h6Pose mesh_pose(const Body& body, const RigidState& state) {
  return {to(Vec3(state.x - state.R * body.com)), to(state.q)};
}
inline h6Pose mesh_pose(const Body& body) { return mesh_pose(body, body); }
inline h6Velocity mesh_velocity(const Body& body, const RigidState& state) {
  return {to(Vec3(state.v - state.w.cross(state.R * body.com))), to(state.w)};
}
inline void set_mesh_pose(Body& body, const h6Pose& pose) {
  body.q = from(pose.q).normalized();
  body.R = body.q.toRotationMatrix();
  body.x = from(pose.p) + body.R * body.com;
}

}  // namespace h6
