// SPDX-License-Identifier: Apache-2.0
// passivity.h - energy that nobody put in is not given out: a time-domain passivity observer and
// controller (Hannaford & Ryu 2002) in six dimensions. METHOD.md, Sec. 4.
//
// Two kinds of ports, each an option of its own: a hand at its device, and the contacts of a shell
// body. Both keep E, the energy that went in less what came out [J].
#pragma once
#include <algorithm>

#include "hapsix/hapsix.h"
#include "runtime/base/math.h"

namespace h6 {

// The port between a device and the engine. All in the device's units and poses.
class HandPort {
 public:
  void set(const Vec3& com) { com_ = com; }  // mesh frame [m]
  // The mesh frame is at `pose` now; `wrench` acted on the engine all the way from the last pose:
  // E += wrench . (x - x', log(q q'^-1)), exact for a wrench that is held between samples.
  void move(const h6Pose& pose, const h6Wrench& wrench);
  // Observing starts, and the engine holds `stored` [J], which nobody has to put in first.
  void start(double stored) {
    energy_ = stored;
    known_ = true;
    share_ = 1;
  }
  // The engine holds no more than `stored` [J]: what was put in beyond that is spent and finances
  // nothing later.
  void spend(double stored) { energy_ = std::min(energy_, stored); }
  // Once a frame of `dt` seconds, after move. Changes the wrench that the hand is about to feel so
  // that E stays at 0 or above if the next motion is like the last one, and within one frame's work
  // of 0 if it is not; true when it did. Neither force [N] nor torque [N m] exceeds the larger of
  // its bound and what it was.
  bool damp(h6Wrench& felt, double max_force, double max_torque, double dt);
  void forget() { known_ = false; }  // E is not known until the next start
  bool known() const { return known_; }
  double energy() const { return energy_; }

 private:
  bool add_damper(Vec3& force, Vec3& torque, double max_force, double max_torque, double dt) const;
  double share_for(const Vec3& force, const Vec3& torque) const;

  Vec3 com_ = Vec3::Zero();
  double energy_ = 0;
  bool known_ = false, placed_ = false;
  h6Pose pose_{{0, 0, 0}, {1, 0, 0, 0}};
  Vec3 moved_ = Vec3::Zero(), turned_ = Vec3::Zero();  // since the sample before [m], [rad]
  double move_change_ = 0, turn_change_ = 0;  // how much that changed from frame to frame, held
  double share_ = 1;                          // of the wrench, in the last frame
};

struct Hand;
// Impedance: the device's new pose, under the wrench that it was told in the last frame.
void observe_hand(h6Session& s, Hand& hand);
// Impedance: the same limits as the coupling's; true when it changed the wrench.
bool damp_hand(h6Session& s, Hand& hand, h6Wrench& felt);
// What the device is told in the end. In the admittance modes the port is observed here: the
// wrench that came in, over the motion that goes out; nothing is changed, for neither is ours.
void note_command(h6Session& s, Hand& hand, const h6DeviceCommand& command);

// E of the contacts of one shell body with whatever they touch.
struct ContactPort {
  double energy = 0;
  bool known = false;
  double alpha = 0;  // the controller's damping in this frame, on top of beta [s]
};

// Power of the contacts when alpha of something is taken from them: w0 - w1 alpha + w2 alpha^2.
struct ReliefPower {
  double w0 = 0, w1 = 0, w2 = 0;
};
// The least alpha >= 0 that keeps that power at `most`; where none does, the one of least power.
double relief_for(const ReliefPower& power, double most);

// Before the step, when all wrenches are known: damps contacts that would give out more than E.
void damp_contacts(h6Session& s);
// After it: what the contacts did to the bodies that moved.
void observe_contacts(h6Session& s);
// A body was put somewhere else: what its contacts and couplings hold there counts as put in.
void forget_energy(h6Session& s, std::int32_t body);
// The least E of all ports that are observed, or 0.
double least_energy(const h6Session& s);

}  // namespace h6
