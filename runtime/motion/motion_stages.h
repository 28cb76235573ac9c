// SPDX-License-Identifier: Apache-2.0
// motion_stages.h - the stages that couple hands to bodies and move the bodies.
#pragma once
#include <span>

#include "runtime/contact/deformation.h"
#include "runtime/contact/pair.h"
#include "runtime/contact/settings.h"
#include "runtime/motion/hand.h"
#include "runtime/motion/solve.h"

namespace h6 {

// Moving bodies that pairs connect. They are solved as one system.
struct Island {
  std::int32_t body[kIslandBodies];
  int count;
};

// Gives a device's sample to its hand. A sample that is not finite is not used: the hand then stays
// where it last was, without a wrench.
void accept(HandDevice& device, Hand& hand, const Body& body, const h6DeviceSample& given,
            double dt, h6Status& status);
// The hand's way in this frame: shift of the body's centre of mass [m], turn [rad].
struct Way {
  double shift = 0, turn = 0;
};
Way way_of(const Hand& hand, const Body& body);
// Puts the hand at this share of its way, 0 .. 1, and with it a body under direct coupling. Call it
// before contacts are found.
void hold(Hand& hand, Body& body, double share);
// Adds the hand's wrench on its body to `acting`, by coupling and device mode. METHOD.md, Sec. 4.
void couple(const Settings& set, Hand& hand, const Body& body, LinearWrench& acting,
            h6Status& status);
// Pseudo-admittance: one time step of the manipulandum between the driver's coupling and the body.
void step_manipulandum(const Settings& set, Hand& hand, const Body& body, h6Status& status);
// Adds damping to contacts that strike so fast that their springs would not stop them. For frames
// of several steps.
void stop_impacts(const Settings& set, std::span<const Body> bodies,
                  std::span<const ShellBody> shells, std::span<LinearWrench> acting);
// Adds the change of one time step to the velocities of all free bodies.
void accelerate_bodies(const Settings& set, std::span<Body> bodies,
                       std::span<const LinearWrench> acting, std::span<const ShellBody> shells,
                       std::span<const Island> islands, h6Status& status);
// Moves all free bodies by one time step, with the velocities that they have.
void move_bodies(const Settings& set, std::span<Body> bodies, std::span<const Island> islands,
                 h6Status& status);
// Adds to the wrenches on rigid bodies how the bodies that bend will answer in this step. Call it
// when all other wrenches are known.
void fold_bends(const Settings& set, std::span<const Body> bodies, std::span<Deformation> bends,
                std::span<LinearWrench> acting, h6Status& status);
// Finds the coming step of the modes, when the rigid bodies have their new velocities.
void accelerate_bends(const Settings& set, std::span<const Body> bodies,
                      std::span<Deformation> bends);
void move_bends(std::span<Deformation> bends, h6Status& status);
// One step of a body without mass towards the pose in which its wrenches balance. No point moves
// farther than `most` [m].
void step_static(const Settings& set, Body& body, const LinearWrench& acting, double most,
                 h6Status& status);
// Makes the command for the device: in impedance mode the reaction to the hand's wrench on the
// body, in the admittance modes the pose of the body or the manipulandum. `command` may be null.
void send(HandDevice& device, Hand& hand, Body& body, double dt, h6DeviceCommand* command,
          h6Status& status);
// Admittance modes: if the safety chain held the device back, this holds `state` back too, by at
// most its motion in this frame.
void follow_device(const HandDevice& device, const Body& body, RigidState& state,
                   const h6BodyState& wanted, const h6DeviceCommand& passed, double h);

// The damper that makes a hand's spring of stiffness k critical for an inertia, times the
// coupling's damping ratio.
inline double coupling_damper(const h6CouplingDef& c, double k, double inertia) {
  return 2 * c.damping_ratio * std::sqrt(k * inertia);
}
// The mean principal inertia [kg m^2].
inline double mean_inertia(const Body& body) { return body.inertia.trace() / 3; }

// A hand's virtual coupling: the wrench that pulls `pulled` to `target`, with its derivatives by
// the pose and velocity of `pulled`.
struct Pull {
  LinearWrench wrench;
  bool cut = false;  // saturated
};
Pull pull_of(h6Gradient gradient, const h6CouplingDef& coupling, const Body& body,
             const RigidState& target, const RigidState& pulled);

// For a rigid body in this state, whose inertia is that of `body` in the ratio of the masses: its
// mass matrix, its gyroscopic term [0; w x I w], and its velocity (v, w). World frame.
Mat6 mass_matrix(const Body& body, const RigidState& state, double mass);
Vec6 gyroscopic(const Body& body, const RigidState& state, double mass);
Vec6 velocity(const RigidState& state);
void add_velocity(RigidState& state, const Vec6& du, bool translation_only);
// Moves by the velocity for h seconds. False when the result is not finite: the state then stays
// where it was, at rest.
bool move_or_rest(RigidState& state, double h, bool translation_only);

}  // namespace h6
