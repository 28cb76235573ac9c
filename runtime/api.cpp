// SPDX-License-Identifier: Apache-2.0
// api.cpp - the public functions that read and change a session.
#include <algorithm>
#include <bit>
#include <cstring>

#include "runtime/frame/session.h"

namespace h6 {

// Mixes every bit of all poses, velocities and samples, in order (multiply and shift, 64 bits). A
// changed sample changes the hash of its own frame, even if it moves nothing.
std::uint64_t state_hash(const h6Session& s, const h6DeviceSample* samples) {
  std::uint64_t hash = 0x9e3779b97f4a7c15u;
  const auto mix_bits = [&hash](std::uint64_t bits) {
    hash = (hash ^ bits) * 0xd6e8feb86659fd93u;
    hash ^= hash >> 32;
  };
  const auto mix = [&mix_bits](const double* values, int count) {
    for (int i = 0; i < count; ++i) {
      std::uint64_t bits;
      std::memcpy(&bits, &values[i], sizeof bits);
      mix_bits(bits);
    }
  };
  const auto mix_state = [&mix](const RigidState& state) {
    mix(state.x.data(), 3);
    mix(state.q.coeffs().data(), 4);
    mix(state.v.data(), 3);
    mix(state.w.data(), 3);
  };
  for (const Body& body : s.bodies) mix_state(body);
  // In the other modes the manipulandum follows from the sample.
  for (const Hand& hand : s.hands)
    if (hand.mode == H6_PSEUDO_ADMITTANCE) mix_state(hand.manipulandum);
  for (const FrictionSpring& spring : s.frictions) mix(spring.q.data(), 6);
  for (std::size_t h = 0; h < s.hands.size(); ++h) {
    const h6DeviceSample& in = samples[h];
    mix(&in.pose.p.x, 7);
    mix(&in.velocity.linear.x, 6);
    mix_bits(in.buttons);
    if (s.hands[h].mode != H6_IMPEDANCE) mix(&in.wrench.force.x, 6);
  }
  return hash;
}

void forget_friction(h6Session& s, std::int32_t body) {
  for (std::size_t i = 0; i < s.frictions.size(); ++i)
    if (s.pairs[i].a == body || s.pairs[i].b == body) s.frictions[i] = {};
}

namespace {

// The body was put somewhere else, so the energy in its new contacts and couplings counts as put
// in.
void forget_energy(h6Session& s, std::int32_t body) {
  for (ShellBody& shell : s.shells)
    for (const Pair& pair : shell.pairs)
      if (pair.a == body || pair.b == body) shell.port.known = false;
  for (std::size_t h = 0; h < s.hands.size(); ++h)
    if (s.hands[h].body == body) s.devices[h].port.forget();
}

}  // namespace

}  // namespace h6

using namespace h6;

extern "C" {

h6Status h6Step(h6Session* session, const h6DeviceSample* samples, h6DeviceCommand* commands) {
  return frame(*session, samples, commands);
}

void h6SetCoarse(h6Session* session, uint32_t pairs, uint32_t points) {
  session->anytime.forced = pairs;
  session->anytime.forced_points = std::bit_floor(std::min(points, 8u));
}

h6BodyState h6GetBody(const h6Session* session, int32_t index) {
  H6_ASSERT(index >= 0 && static_cast<std::size_t>(index) < session->bodies.size());
  const Body& body = session->bodies[index];
  return {mesh_pose(body), {to(body.v), to(body.w)}};
}

void h6SetBody(h6Session* session, int32_t index, const h6BodyState* state) {
  H6_ASSERT(index >= 0 && static_cast<std::size_t>(index) < session->bodies.size());
  Body& body = session->bodies[index];
  set_mesh_pose(body, state->pose);
  body.v = from(state->velocity.linear);
  body.w = from(state->velocity.angular);
  body.gained_v.setZero(), body.gained_w.setZero();
  if (body.translation_only) body.w.setZero();
  if (body.motion != Motion::dynamic) body.v.setZero(), body.w.setZero();
  body.step_rate.setZero();
  if (session->frame == 0) forget_relief(*session, index);
  // An obstacle that a program moves drags along what rests on it.
  if (!body.fixed) forget_friction(*session, index);
  forget_energy(*session, index);
  for (Hand& hand : session->hands)
    if (hand.body == index) hand.manipulandum = body;
}

h6Contacts h6GetContacts(const h6Session* session, int32_t index) {
  H6_ASSERT(index >= 0 && static_cast<std::size_t>(index) < session->bodies.size());
  const ShellBody* shell = find_shell(*session, index);
  const Contacts c = shell ? shell->contacts : Contacts{};
  return {c.count, c.depth, c.nx, c.ny, c.nz, c.gx,     c.gy,    c.gz,         c.rx,
          c.ry,    c.rz,    c.tx, c.ty, c.tz, c.weight, c.point, c.field_body, c.load};
}

h6FrameReport h6GetFrame(const h6Session* session) { return session->report; }
h6CouplingDef h6GetCoupling(const h6Session* session, int32_t hand) {
  return session->hands[hand].coupling;
}
double h6GetVoxel(const h6Session* session, int32_t body) { return session->bodies[body].voxel; }

void h6SetRating(h6Session* session, int32_t hand, const h6DeviceCapabilities* capabilities) {
  set_rating(session->devices[hand], *capabilities);
}
void h6Fault(h6Session* session, h6Cause cause) {
  for (HandDevice& device : session->devices) device.guard.fault(cause);
}
void h6Arm(h6Session* session) {
  for (HandDevice& device : session->devices) device.guard.arm();
}
void h6Rearm(h6Session* session) { h6Arm(session); }
void h6Disarm(h6Session* session) {
  for (HandDevice& device : session->devices) device.guard.disarm();
}
void h6LoseDevice(h6Session* session, int32_t hand) {
  session->devices[hand].lost = true;
  h6Fault(session, H6_CAUSE_DEVICE_LOST);
}
void h6NoteInterval(h6Session* session, double seconds) {
  for (HandDevice& device : session->devices) note_interval(device, session->settings.dt, seconds);
}
h6SafetyInput h6GetSafetyInput(const h6Session* session, int32_t hand) {
  return session->devices[hand].guard.input();
}
void h6SetSafetyInput(h6Session* session, int32_t hand, const h6SafetyInput* input) {
  HandDevice& to = session->devices[hand];
  to.guard.repeat(input->asked);
  to.lost = (input->asked & H6_ASKED_LOST) != 0;
  to.overdue = input->overdue > 0 ? input->overdue : 0;
}
h6HandSafety h6GetSafety(const h6Session* session, int32_t hand) {
  return session->devices[hand].guard.report();
}

}  // extern "C"
