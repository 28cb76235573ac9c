// SPDX-License-Identifier: Apache-2.0
// api.cpp - the public functions that read and change a session.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

#include "runtime/base/foreign_enum.h"
#include "runtime/frame/session.h"

namespace h6 {

// Mixes every bit of all poses, velocities and samples (multiply and shift, 64 bits). Bodies that
// never moved come first, so that they need not be mixed again in every frame; the others follow in
// order. A changed sample changes the hash of its own frame, even if it moves nothing.
std::uint64_t state_hash(h6Session& s, const h6DeviceSample* samples) {
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
  const std::span<const std::uint32_t> lively = s.near.all_lively();
  if (!s.still_hashed) {
    std::size_t next = 0;
    for (std::size_t i = 0; i < s.bodies.size(); ++i)
      next < lively.size() && lively[next] == i ? void(++next) : mix_state(s.bodies[i]);
    s.still_hash = hash;
    s.still_hashed = true;
  }
  hash = s.still_hash;
  for (const std::uint32_t i : lively) mix_state(s.bodies[i]);
  for (const Deformation& d : s.bends) mix(d.q, d.modes), mix(d.v, d.modes);
  // In the other modes the manipulandum follows from the sample.
  for (const Hand& hand : s.hands)
    if (hand.mode == H6_PSEUDO_ADMITTANCE) mix_state(hand.manipulandum);
  if (!s.frictions.empty())
    for (const NearPairs::Near& near : s.near.all_near())
      if (const FrictionSpring& spring = s.frictions[near.slot]; spring.holds)
        mix(spring.q.data(), 6);
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
  for (const NearPairs::Near& near : s.near.all_near()) {
    const Pair& pair = s.near.pairs[near.slot];
    if (pair.friction && (pair.a == body || pair.b == body)) *pair.friction = {};
  }
}

namespace {

// The body was put somewhere else, so the energy in its new contacts and couplings counts as put
// in.
void forget_energy(h6Session& s, std::int32_t body) {
  for (ShellBody& shell : s.shells)
    if (shell.body == body || may_touch(s, shell.body, body)) shell.port.known = false;
  for (std::size_t h = 0; h < s.hands.size(); ++h)
    if (s.hands[h].body == body) s.devices[h].port.forget();
}

// The rows of an index that a caller gave, or null.
template <class T>
T* at(std::span<T> rows, std::int32_t i) {
  return i >= 0 && static_cast<std::size_t>(i) < rows.size() ? &rows[static_cast<std::size_t>(i)]
                                                             : nullptr;
}
Body* body_at(const h6Session* s, std::int32_t i) {
  return s ? at(std::span<Body>(s->bodies), i) : nullptr;
}
HandDevice* device_at(const h6Session* s, std::int32_t i) {
  return s ? at(std::span<HandDevice>(s->devices), i) : nullptr;
}
// The same for a function that changes it, which a loop's session refuses.
HandDevice* own_device_at(const h6Session* s, std::int32_t i) {
  return s && !run_by_loop(*s) ? device_at(s, i) : nullptr;
}
// Leaves a request to the loop that runs the session; false: none does. It may only take force
// away.
bool ask_loop(h6Session& s, std::uint32_t request) {
  if (!run_by_loop(s)) return false;
  s.asked.fetch_or(request);
  return true;
}

}  // namespace

}  // namespace h6

using namespace h6;

extern "C" {

h6Status h6Step(h6Session* session, const h6DeviceSample* samples, h6DeviceCommand* commands) {
  if (!session) return H6_OUTPUT_FAULT;
  const std::size_t hands = session->hands.size();
  Owner none = Owner::nobody;
  if ((hands && !samples) || !session->owner.compare_exchange_strong(none, Owner::step)) {
    if (commands) std::fill_n(commands, hands, h6DeviceCommand{});
    return H6_OUTPUT_FAULT;
  }
  const h6Status status = frame(*session, samples, commands);
  session->owner.store(Owner::nobody, std::memory_order_release);
  return status;
}

void h6GetRecord(const h6Session* session, const h6DeviceSample* samples,
                 const h6DeviceCommand* commands, h6FrameRecord* out) {
  if (!out) return;
  *out = {};
  if (!session || (!session->hands.empty() && (!samples || !commands))) return;
  const h6Session& s = *session;
  out->report = s.report;
  out->time = static_cast<double>(s.report.frame) * s.settings.dt;
  for (std::size_t h = 0; h < s.hands.size(); ++h) {
    out->hand[h] = samples[h];
    out->command[h] = commands[h];
    out->body[h] = h6GetBody(session, s.hands[h].body);
    out->state[h] = s.devices[h].guard.state();
    out->safety_input[h] = s.devices[h].guard.input();
  }
}

void h6SetCoarse(h6Session* session, uint32_t pairs, uint32_t points) {
  if (!session || run_by_loop(*session)) return;
  session->anytime.forced = pairs;
  session->anytime.forced_points = std::bit_floor(std::min(points, 8u));
}

h6BodyState h6GetBody(const h6Session* session, int32_t index) {
  const Body* found = body_at(session, index);
  if (!found) return {{{}, {1, 0, 0, 0}}, {}};
  const Body& body = *found;
  return {mesh_pose(body), {to(body.v), to(body.w)}};
}

void h6SetBody(h6Session* session, int32_t index, const h6BodyState* state) {
  Body* found = body_at(session, index);
  if (!found || !state || !usable(state->pose, state->velocity) || run_by_loop(*session)) return;
  Body& body = *found;
  if (make_lively(session->near, static_cast<std::size_t>(index))) session->still_hashed = false;
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

size_t h6GetDeformation(const h6Session* session, int32_t index, double* q, double* velocity,
                        size_t capacity) {
  const Body* found = body_at(session, index);
  if (!found || !found->bend) return 0;
  const Deformation& d = *found->bend;
  const auto modes = static_cast<std::size_t>(d.modes);
  if (q) std::copy_n(d.q, std::min(capacity, modes), q);
  if (velocity) std::copy_n(d.v, std::min(capacity, modes), velocity);
  return modes;
}

bool h6SetDeformation(h6Session* session, int32_t index, const double* q, const double* velocity,
                      size_t count) {
  Body* found = body_at(session, index);
  if (!found || !found->bend || !q || run_by_loop(*session)) return false;
  Deformation& d = *found->bend;
  if (count != static_cast<std::size_t>(d.modes)) return false;
  for (std::size_t j = 0; j < count; ++j)
    if (!(std::fabs(q[j]) <= kMost) || (velocity && !(std::fabs(velocity[j]) <= kMost)))
      return false;
  for (std::size_t j = 0; j < count; ++j) d.q[j] = q[j], d.v[j] = velocity ? velocity[j] : 0;
  return true;
}

h6Contacts h6GetContacts(const h6Session* session, int32_t index) {
  const ShellBody* shell = body_at(session, index) ? find_shell(*session, index) : nullptr;
  const Contacts c = shell ? shell->contacts : Contacts{};
  return {c.count, c.depth, c.nx, c.ny, c.nz,     c.gx,    c.gy,         c.gz,   c.rx, c.ry,
          c.rz,    c.tx,    c.ty, c.tz, c.weight, c.point, c.field_body, c.load, {}};
}

h6FrameReport h6GetFrame(const h6Session* session) {
  return session ? session->report : h6FrameReport{};
}
h6CouplingDef h6GetCoupling(const h6Session* session, int32_t hand) {
  return device_at(session, hand) ? session->hands[static_cast<std::size_t>(hand)].coupling
                                  : h6CouplingDef{};
}
double h6GetVoxel(const h6Session* session, int32_t body) {
  const Body* found = body_at(session, body);
  return found ? found->voxel : 0;
}

void h6SetRating(h6Session* session, int32_t hand, const h6DeviceCapabilities* capabilities) {
  HandDevice* device = own_device_at(session, hand);
  if (device && capabilities) set_rating(*device, *capabilities);
}
void h6Fault(h6Session* session, h6Cause cause) {
  const std::uint32_t number = raw_number(cause);
  if (!session || number == H6_CAUSE_NONE || number >= H6_CAUSE_COUNT) return;
  if (!ask_loop(*session, 1u << number)) fault_all(*session, cause);
}
void h6Arm(h6Session* session) {
  if (!session || run_by_loop(*session)) return;
  for (HandDevice& device : session->devices) device.guard.arm();
}
void h6Rearm(h6Session* session) { h6Arm(session); }
void h6Disarm(h6Session* session) {
  if (session && !ask_loop(*session, kAskDisarm)) disarm_all(*session);
}
void h6LoseDevice(h6Session* session, int32_t hand) {
  HandDevice* device = device_at(session, hand);
  if (!device || ask_loop(*session, 1u << H6_CAUSE_DEVICE_LOST)) return;
  device->lost = true;
  fault_all(*session, H6_CAUSE_DEVICE_LOST);
}
void h6NoteInterval(h6Session* session, double seconds) {
  if (!session || run_by_loop(*session)) return;
  for (HandDevice& device : session->devices) note_interval(device, session->settings.dt, seconds);
}
h6SafetyInput h6GetSafetyInput(const h6Session* session, int32_t hand) {
  const HandDevice* device = device_at(session, hand);
  return device ? device->guard.input() : h6SafetyInput{};
}
void h6SetSafetyInput(h6Session* session, int32_t hand, const h6SafetyInput* input) {
  HandDevice* device = own_device_at(session, hand);
  if (!device || !input) return;
  HandDevice& to = *device;
  to.guard.repeat(input->asked);
  to.lost = (input->asked & H6_ASKED_LOST) != 0;
  const bool slow = (input->asked & H6_ASKED_SLOW) != 0;
  (slow ? to.missed : to.overdue) = input->overdue > 0 ? std::min(input->overdue, kMost) : 0;
  (slow ? to.overdue : to.missed) = 0;
}
void h6GetSafety(const h6Session* session, int32_t hand, h6HandSafety* out) {
  if (!out) return;
  const HandDevice* device = device_at(session, hand);
  *out = device ? device->guard.report() : h6HandSafety{};
}

}  // extern "C"
