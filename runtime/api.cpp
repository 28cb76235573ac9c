// SPDX-License-Identifier: Apache-2.0
// api.cpp - a session seen through the contract.
#include <algorithm>
#include <bit>
#include <cstring>

#include "runtime/frame/stages.h"

namespace h6 {

h6Pose mesh_pose(const Body& body) { return mesh_pose(body, body); }
h6Pose mesh_pose(const Body& body, const RigidState& state) {
  return {to(Vec3(state.x - state.R * body.com)), to(state.q)};
}
h6Velocity mesh_velocity(const Body& body, const RigidState& state) {
  return {to(Vec3(state.v - state.w.cross(state.R * body.com))), to(state.w)};
}

void set_mesh_pose(Body& body, const h6Pose& pose) {
  body.q = from(pose.q).normalized();
  body.R = body.q.toRotationMatrix();
  body.x = from(pose.p) + body.R * body.com;
}

// Every bit of every pose and velocity and of what hands said, mixed in order (multiply and shift,
// 64 bits). A changed sample shows in its own frame, felt or not.
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
  for (std::size_t i = 0; i < s.body_count; ++i) mix_state(s.bodies[i]);
  // Elsewhere the manipulandum is where the hand's sample says.
  for (std::size_t h = 0; h < s.hand_count; ++h)
    if (s.hands[h].mode == H6_PSEUDO_ADMITTANCE) mix_state(s.hands[h].manipulandum);
  for (std::size_t h = 0; h < s.hand_count; ++h) {
    const h6DeviceSample& in = samples[h];
    mix(&in.pose.p.x, 7);
    mix(&in.velocity.linear.x, 6);
    mix_bits(in.buttons);
    if (s.hands[h].mode != H6_IMPEDANCE) mix(&in.wrench.force.x, 6);  // else not read
  }
  return hash;
}

void set_rating(Hand& hand, const h6DeviceCapabilities& capabilities) {
  hand.guard.set_limits(limits_of(capabilities, hand.safety));
  hand.watch.set(hand.safety, capabilities);
}

void note_interval(Hand& hand, double dt, double seconds) {
  hand.overdue = seconds > 2 * dt ? seconds - dt : 0;
}

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
  H6_ASSERT(index >= 0 && static_cast<std::size_t>(index) < session->body_count);
  const Body& body = session->bodies[index];
  return {mesh_pose(body), {to(body.v), to(body.w)}};
}

void h6SetBody(h6Session* session, int32_t index, const h6BodyState* state) {
  H6_ASSERT(index >= 0 && static_cast<std::size_t>(index) < session->body_count);
  Body& body = session->bodies[index];
  set_mesh_pose(body, state->pose);
  body.v = from(state->velocity.linear);
  body.w = from(state->velocity.angular);
  if (body.translation_only) body.w.setZero();
  if (body.motion != Motion::dynamic) body.v.setZero(), body.w.setZero();
  std::fill_n(body.series_y, 6, 0.0);
  forget_energy(*session, index);
  for (std::size_t h = 0; h < session->hand_count; ++h)
    if (session->hands[h].body == index) session->hands[h].manipulandum = body;
}

h6Contacts h6GetContacts(const h6Session* session, int32_t index) {
  H6_ASSERT(index >= 0 && static_cast<std::size_t>(index) < session->body_count);
  const Contacts& c = session->contacts[index];
  return {c.count, c.depth, c.nx, c.ny, c.nz, c.gx,     c.gy,    c.gz,         c.rx,
          c.ry,    c.rz,    c.tx, c.ty, c.tz, c.weight, c.point, c.field_body, c.load};
}

h6FrameReport h6GetFrame(const h6Session* session) { return session->report; }
h6CouplingDef h6GetCoupling(const h6Session* session, int32_t hand) {
  return session->hands[hand].coupling;
}
double h6GetVoxel(const h6Session* session, int32_t body) { return session->bodies[body].voxel; }

void h6SetRating(h6Session* session, int32_t hand, const h6DeviceCapabilities* capabilities) {
  set_rating(session->hands[hand], *capabilities);
}
void h6Fault(h6Session* session, h6Cause cause) {
  for (std::size_t h = 0; h < session->hand_count; ++h) session->hands[h].guard.fault(cause);
}
void h6Arm(h6Session* session) {
  for (std::size_t h = 0; h < session->hand_count; ++h) session->hands[h].guard.arm();
}
void h6Rearm(h6Session* session) { h6Arm(session); }
void h6Disarm(h6Session* session) {
  for (std::size_t h = 0; h < session->hand_count; ++h) session->hands[h].guard.disarm();
}
void h6LoseDevice(h6Session* session, int32_t hand) {
  session->hands[hand].lost = true;
  h6Fault(session, H6_CAUSE_DEVICE_LOST);
}
void h6NoteInterval(h6Session* session, double seconds) {
  for (std::size_t h = 0; h < session->hand_count; ++h)
    note_interval(session->hands[h], session->dt, seconds);
}
h6SafetyInput h6GetSafetyInput(const h6Session* session, int32_t hand) {
  return session->hands[hand].guard.input();
}
void h6SetSafetyInput(h6Session* session, int32_t hand, const h6SafetyInput* input) {
  Hand& to = session->hands[hand];
  to.guard.repeat(input->asked);
  to.lost = (input->asked & H6_ASKED_LOST) != 0;
  to.overdue = input->overdue > 0 ? input->overdue : 0;
}
h6HandSafety h6GetSafety(const h6Session* session, int32_t hand) {
  return session->hands[hand].guard.report();
}

}  // extern "C"
