// SPDX-License-Identifier: Apache-2.0
// passivity.h - keeps ports from giving out more energy than they took in: a time-domain passivity
// observer and controller (Hannaford & Ryu 2002) in six dimensions. METHOD.md, Sec. 4, "Passivity".
//
// There are two kinds of ports, each with its own option: a hand at its device, and the contacts of
// a shell body. Each keeps E, the energy that went in less the energy that came out [J].
#pragma once
#include <algorithm>
#include <span>

#include "hapsix/hapsix.h"
#include "runtime/base/math.h"
#include "runtime/contact/body.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"
#include "runtime/hand/safety.h"

namespace h6 {

// The port between a device and the engine, in the device's units and poses. The device applies a
// command up to kMostDelay frames late.
class HandPort final : public WrenchShare {
 public:
  static constexpr std::uint32_t kMostDelay = 2;

  void set(const Vec3& com) { com_ = com; }  // centre of mass, mesh frame [m]
  // Commands act at most so many frames late; `known`: always exactly so many.
  void set_delay(std::uint32_t frames, bool known) {
    delay_ = std::min(frames, kMostDelay);
    known_delay_ = known;
  }
  void same_delay(const HandPort& port) { set_delay(port.delay_, port.known_delay_); }
  // The mesh frame is at `pose` now, and `wrench` acted on the engine since the last pose:
  // E += wrench . (x - x', log(q q'^-1)), exact for a wrench that is held between samples.
  void move(const h6Pose& pose, const h6Wrench& wrench) { move(pose, {&wrench, 1}); }
  // The same when one of several wrenches acted: E gets the least.
  void move(const h6Pose& pose, std::span<const h6Wrench> wrenches);
  // The same under the reaction to the sent commands that may have acted.
  void move(const h6Pose& pose);
  // Notes the wrench that was sent to the hand in this frame.
  void sent(const h6Wrench& felt);
  // Starts to observe with E = `stored`, the energy that the engine holds already [J].
  void start(double stored) {
    energy_ = stored;
    known_ = true;
    share_ = 1;
  }
  // The engine holds no more than `stored` [J]. Energy put in beyond that was dissipated and must
  // not pay for anything later.
  void spend(double stored) { energy_ = std::min(energy_, stored); }
  // Call it once a frame of `dt` seconds, after move. It takes energy from the hand along its last
  // motion, if the wrench that it is about to feel would make E negative. Returns whether it
  // changed the wrench. Neither force [N] nor torque [N m] exceeds the larger of its bound and its
  // former value.
  bool damp(h6Wrench& felt, double max_force, double max_torque, double dt);
  // The share of the wrench that may be sent, after damp. E then stays at 0 or above if the next
  // motions are like the last one, and within about one frame's work of 0 if they are not.
  double share(const Vec3& force, const Vec3& torque) override;
  void forget() { known_ = false; }  // E is not known until the next start
  bool known() const { return known_; }
  double energy() const { return energy_; }

 private:
  // The energy that a wrench on the hand takes out if the next motion is like the last one, and
  // half of how much more or less it may be, one frame later [J].
  struct Outlook {
    double out, doubt;
  };
  Outlook outlook(const Vec3& force, const Vec3& torque) const;
  double available() const;
  double share_for(const Vec3& force, const Vec3& torque) const;

  Vec3 com_ = Vec3::Zero();
  double energy_ = 0;
  bool known_ = false, placed_ = false, known_delay_ = false;
  std::uint32_t delay_ = 0;
  h6Wrench sent_[kMostDelay + 1]{};  // to the hand, newest first
  double frame_ = 1e-3;              // length of the present frame [s]
  h6Pose pose_{{0, 0, 0}, {1, 0, 0, 0}};
  Vec3 moved_ = Vec3::Zero(), turned_ = Vec3::Zero();  // since the previous sample [m], [rad]
  double move_change_ = 0, turn_change_ = 0;           // recent peaks of their change in one frame
  double share_ = 1;                                   // the share of the wrench let through last
};

struct Hand;
struct HandDevice;
// Impedance: notes the device's new pose, under the wrench of the last command.
void observe_hand(const Settings& set, std::span<const Body> bodies,
                  std::span<const ShellBody> shells, const Hand& hand, HandDevice& device);
// Impedance: keeps within the coupling's limits; true when it changed the wrench.
bool damp_hand(HandDevice& device, const Hand& hand, h6Wrench& felt, double dt);
// Notes the command. In the admittance modes this observes the port: the wrench that came in, over
// the motion that goes out. It changes nothing there.
void note_command(HandDevice& device, const Hand& hand, const h6DeviceCommand& command);

// The power of the contacts [W] after alpha times a given wrench has been subtracted from theirs:
// w0 - w1 alpha + w2 alpha^2.
struct ReliefPower {
  double w0 = 0, w1 = 0, w2 = 0;
};
// The least alpha >= 0 with a power of at most `most` [W]; if there is none, the alpha of least
// power.
double relief_for(const ReliefPower& power, double most);

// Damps contacts that would give out more than E. Call it before the step, when all wrenches are
// known.
void damp_contacts(const Settings& set, std::span<const Body> bodies, std::span<ShellBody> shells,
                   std::span<LinearWrench> acting, std::span<Hand> hands, h6Status& status);
// Counts the work that the contacts did on the bodies that moved. Call it after the step.
void observe_contacts(const Settings& set, std::span<const Body> bodies,
                      std::span<ShellBody> shells);
// The least E of all observed ports, or 0 if none is observed [J].
double least_energy(const Settings& set, std::span<const ShellBody> shells,
                    std::span<const HandDevice> devices);

}  // namespace h6
