// SPDX-License-Identifier: Apache-2.0
// loop_view.cpp - poses and contacts for a viewer, and one session taking over from another.
#include "runtime/loop/loop_view.h"

#include <algorithm>

#include "runtime/frame/session.h"

namespace h6 {

LoopView::LoopView(const h6Session& s, std::size_t contacts) {
  slots_.prepare([&](Slot& slot) {
    for (const Body& body : s.bodies) slot.body.push_back(mesh_pose(body));
    slot.contact.resize(contacts);
    std::size_t modes = 0;
    for (const Deformation& d : s.bends) modes += static_cast<std::size_t>(d.modes);
    slot.bend.resize(modes);
  });
}

namespace {

h6ViewContact row_of(const Contacts& c, std::size_t i, const Vec3& centre, std::int32_t body) {
  h6ViewContact row;
  const Vec3 p = centre + Vec3(c.rx[i], c.ry[i], c.rz[i]);
  for (int a = 0; a < 3; ++a) row.position[a] = p[a];
  row.normal[0] = c.nx[i], row.normal[1] = c.ny[i], row.normal[2] = c.nz[i];
  row.torque_direction[0] = c.tx[i], row.torque_direction[1] = c.ty[i];
  row.torque_direction[2] = c.tz[i];
  row.weight = c.weight[i];
  row.depth = c.depth[i];
  row.shell_body = body;
  row.field_body = c.field_body[i];
  return row;
}

}  // namespace

void LoopView::write(const h6Session& s, double time) {
  Slot& slot = slots_.next();
  slot.frame = s.report.frame;
  slot.time = time;
  slot.contacts = 0;
  for (const std::uint32_t b : s.near.all_lively()) slot.body[b] = mesh_pose(s.bodies[b]);
  for (const ShellBody& shell : s.shells) slot.contacts += shell.contacts.count;
  // Where the viewer has no room for all contacts it gets every n-th, so that no region is missing.
  const std::size_t room = slot.contact.size();
  const std::size_t step = room ? (slot.contacts + room - 1) / room : 0;
  slot.rows = 0;
  std::size_t skip = 0;
  for (const ShellBody& shell : s.shells) {
    if (step == 0) break;
    const Contacts& c = shell.contacts;
    std::size_t i = skip;
    for (; i < c.count; i += step)
      slot.contact[slot.rows++] = row_of(c, i, arm_origin(s.bodies[shell.body]), shell.body);
    skip = i - c.count;
  }
  double* bend = slot.bend.data();
  for (const Deformation& d : s.bends) bend = std::copy_n(d.q, d.modes, bend);
  slots_.publish();
}

bool LoopView::read(h6LoopView* out) {
  const Slot* slot = slots_.newest();
  if (!slot) return false;
  *out = {slot->frame, slot->time,           slot->body.size(), slot->body.data(), slot->contacts,
          slot->rows,  slot->contact.data(), slot->bend.size(), slot->bend.data(), {}};
  return true;
}

// Pairs that both sessions have keep their stretch.
static void take_over_friction(h6Session& next, const h6Session& before) {
  for (const NearPairs::Near& near : next.near.all_near()) {
    const Pair& pair = next.near.pairs[near.slot];
    const Pair* had = find_near_pair(before, pair.a, pair.b);
    if (pair.friction && had && had->friction) *pair.friction = *had->friction;
  }
}

void take_over(h6Session& next, const h6Session& before) {
  H6_ASSERT(next.bodies.size() == before.bodies.size() && next.hands.size() == before.hands.size());
  for (const std::uint32_t i : before.near.all_lively()) make_lively(next.near, i);
  next.still_hashed = false;
  for (std::size_t i = 0; i < next.bodies.size(); ++i) {
    if (next.bodies[i].x != before.bodies[i].x ||
        next.bodies[i].q.coeffs() != before.bodies[i].q.coeffs())
      make_lively(next.near, i);
    static_cast<RigidState&>(next.bodies[i]) = before.bodies[i];
    next.bodies[i].step_rate = before.bodies[i].step_rate;
  }
  find_near_pairs(next);
  for (std::size_t i = 0; i < next.hands.size(); ++i) {
    const Hand set = next.hands[i];
    Hand& hand = next.hands[i] = before.hands[i];
    hand.coupling = set.coupling;
    hand.manipulandum_mass = set.manipulandum_mass;
    hand.driver_stiffness = set.driver_stiffness;
    hand.driver_damping = set.driver_damping;
    HandDevice& device = next.devices[i];
    const HandDevice own = device;
    device = before.devices[i];
    device.passivity = own.passivity;
    device.port.same_delay(own.port);
    if (!own.passivity) device.port.forget();
  }
  for (std::size_t i = 0; i < next.bends.size() && i < before.bends.size(); ++i) {
    std::copy_n(before.bends[i].q, before.bends[i].modes, next.bends[i].q);
    std::copy_n(before.bends[i].v, before.bends[i].modes, next.bends[i].v);
  }
  take_over_relief(next, before);
  take_over_friction(next, before);
  next.anytime.no_clock = before.anytime.no_clock;
  next.report = before.report;
  next.frame = before.frame;
}

SessionKind kind_of(const h6Session& session) {
  SessionKind kind{
      session.model, session.bodies.size(), session.hands.size(), session.settings.dt, {}, {}};
  for (std::size_t h = 0; h < session.hands.size(); ++h) {
    kind.body[h] = session.hands[h].body;
    kind.mode[h] = session.hands[h].mode;
  }
  return kind;
}

bool may_take_over(const h6Session* next, const SessionKind& before, h6Error* error) {
  const SessionKind kind = next ? kind_of(*next) : SessionKind{};
  if (!next || kind.model != before.model || kind.bodies != before.bodies ||
      kind.hands != before.hands || kind.dt != before.dt)
    return fail(error, "a loop goes on with a session of the same model, bodies, hands and rate");
  for (std::size_t h = 0; h < kind.hands; ++h)
    if (kind.body[h] != before.body[h] || kind.mode[h] != before.mode[h])
      return fail(error, "a loop goes on with hands on the same bodies, in the same modes");
  return true;
}

}  // namespace h6

extern "C" bool h6TakeOver(h6Session* next, const h6Session* before, h6Error* error) {
  if (!before || next == before)
    return h6::fail(error, "a session goes on where another one stands");
  if (!h6::may_take_over(next, h6::kind_of(*before), error)) return false;
  if (h6::run_by_loop(*next) || h6::run_by_loop(*before))
    return h6::fail(error, H6_ERROR_BUSY, "a loop runs this session: h6ChangeSession is for that");
  h6::take_over(*next, *before);
  return true;
}
