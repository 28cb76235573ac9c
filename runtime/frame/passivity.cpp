// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame/passivity.h"

#include <algorithm>
#include <cmath>

#include "runtime/frame/stages.h"

namespace h6 {
namespace {

// The hand's damper is at most the one that reaches the coupling's bound at this speed [m/s]. At
// the speeds of an encoder's noise the deficit over the motion would be any number.
constexpr double kFullSpeed = 0.05;
constexpr double kStill = 1e-9;  // motion in a frame below which there is no direction [m]
// The share rises from 0 to 1 in this time, and changes of the motion are held as long [s].
constexpr double kMemory = 0.02;

void shorten(Vec3& v, double most) {
  const double n = v.norm();
  if (n > most) v *= most / n;
}

bool free_mass(const Body& body) { return !body.fixed && body.motion == Motion::dynamic; }

Vec6 accelerated_by(const Body& body, const Vec6& f) {
  Vec6 a;
  a.head<3>() = f.head<3>() / body.mass;
  a.tail<3>() = body.R * body.inertia.inverse() * (body.R.transpose() * f.tail<3>());
  if (body.translation_only) a.tail<3>().setZero();
  return a;
}

// Mean velocity in the coming step. For an explicit step it is exact except for gyroscopic terms.
// For an implicit step it is the present velocity, which overestimates what the contacts will give
// out.
Vec6 mean_velocity(const h6Session& s, const Body& body) {
  Vec6 u = velocity(body);
  if (s.integrator == H6_EXPLICIT && free_mass(body))
    u += 0.5 * s.dt * accelerated_by(body, body.f);
  return u;
}

// Adds the power of the contacts' wrench F - alpha c on one body in the coming step.
void add_power(const h6Session& s, const Body& body, const Vec6& F, const Vec6& c,
               ReliefPower& power) {
  const Vec6 u = mean_velocity(s, body);
  power.w0 += F.dot(u);
  power.w1 += c.dot(u);
  if (s.integrator != H6_EXPLICIT || !free_mass(body)) return;
  const Vec6 g = 0.5 * s.dt * accelerated_by(body, c);
  power.w1 += F.dot(g);
  power.w2 += c.dot(g);
}

// Elastic energy of the contacts of a frame [J].
double elastic_energy(const Contacts& c, double stiffness) {
  double sum = 0;
  for (std::size_t i = 0; i < c.count; ++i)
    if (c.depth[i] > 0) sum += double{c.load[i]} * double{c.depth[i]};
  return 0.5 * stiffness * sum;
}

// u_a - S^T u_b.
Vec6 relative(const Pair& pair, const Vec6& ua, const Vec6& ub) {
  Vec6 u = ua - ub;
  u.head<3>() -= ub.tail<3>().cross(pair.arm);
  return u;
}

void take_away(h6Session& s, Pair& pair, const Vec6& f) {
  Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Vec6 on_b = arm_shift(s, pair) * f;
  pair.f -= f;
  if (!a.fixed) a.f -= f;
  if (!b.fixed) b.f += on_b;
  // A hand with direct coupling feels everything that acts on its body.
  for (std::size_t h = 0; h < s.hand_count; ++h) {
    Hand& hand = s.hands[h];
    if (s.bodies[hand.body].motion != Motion::held || hand.mode != H6_IMPEDANCE) continue;
    if (hand.body == pair.a) hand.wrench += f;
    if (hand.body == pair.b) hand.wrench -= on_b;
  }
}

void add_damping(h6Session& s, Pair& pair, double alpha) {
  Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  const Mat6 S = arm_shift(s, pair), D = alpha * pair.B;
  if (!a.fixed) a.D -= D;
  if (!b.fixed) b.D -= S * D * S.transpose();
  if (a.fixed || b.fixed) return;
  pair.Dab += D * S.transpose();
  pair.Dba += S * D;
}

enum class Relief { damping, scaling };

// Reduces the wrenches of one shell body's contacts as little as possible, so that they give out at
// most `most` [W]: by damping along their motion, or by a common share. Returns the power that is
// left [W].
double relieve(h6Session& s, std::size_t first, std::size_t end, double most, Relief by) {
  Body& body = s.bodies[s.pairs[first].a];
  const Vec6 ua = mean_velocity(s, body);
  const auto part = [&](const Pair& pair) -> Vec6 {
    if (by == Relief::scaling) return pair.f;
    return pair.B * relative(pair, ua, mean_velocity(s, s.bodies[pair.b]));
  };
  Vec6 F = Vec6::Zero(), c = Vec6::Zero();
  ReliefPower power;
  for (std::size_t p = first; p < end; ++p) {
    Pair& pair = s.pairs[p];
    if (pair.f.isZero(0)) continue;
    pair.relief = part(pair);
    F += pair.f;
    c += pair.relief;
    const Mat6 S = arm_shift(s, pair);
    add_power(s, s.bodies[pair.b], -S * pair.f, -S * pair.relief, power);
  }
  add_power(s, body, F, c, power);
  if (power.w0 <= most) return power.w0;
  // Contacts that give out power are brought to zero power and no further: together they never
  // pull.
  const double alpha = relief_for(power, power.w0 > 0 ? std::max(most, 0.0) : most);
  if (!(alpha > 0)) return power.w0;
  for (std::size_t p = first; p < end; ++p) {
    if (s.pairs[p].f.isZero(0)) continue;
    take_away(s, s.pairs[p], alpha * s.pairs[p].relief);
    if (by == Relief::damping) add_damping(s, s.pairs[p], alpha);
  }
  if (by == Relief::damping) body.contact_port.alpha = alpha;
  s.report.status |= H6_PASSIVITY;
  return power.w0 - alpha * power.w1 + alpha * alpha * power.w2;
}

// Energy of a spring of stiffness k whose force is at most `most` [J].
double spring_energy(double k, double stretch, double most) {
  const double knee = most / k;
  return stretch <= knee ? 0.5 * k * stretch * stretch : most * (stretch - 0.5 * knee);
}

// Energy of a hand's coupling and body while the body touches nothing [J].
double stored_energy(const Hand& hand, const Body& body) {
  if (body.motion == Motion::held) return 0;
  const h6CouplingDef& c = hand.coupling;
  const RigidState& m = hand.manipulandum;
  double sum = spring_energy(c.stiffness, (m.x - body.x).norm(), c.max_force);
  if (!body.translation_only)
    sum += spring_energy(c.rotational_stiffness, log_rotation(m.q * body.q.conjugate()).norm(),
                         c.max_torque);
  if (body.motion != Motion::dynamic) return sum;
  const Vec3 w = body.R.transpose() * body.w;
  return sum + 0.5 * body.mass * body.v.squaredNorm() + 0.5 * w.dot(body.inertia * w);
}

bool touches(const h6Session& s, std::int32_t body) {
  for (std::size_t p = 0; p < s.pair_count; ++p)
    if ((s.pairs[p].a == body || s.pairs[p].b == body) && !s.pairs[p].f.isZero(0)) return true;
  return false;
}

}  // namespace

void HandPort::move(const h6Pose& pose, const h6Wrench& wrench) {
  if (placed_) {
    const Quat q = from(pose.q), before = from(pose_.q);
    const Vec3 moved = from(pose.p) + q * com_ - from(pose_.p) - before * com_,
               turned = log_rotation(q * before.conjugate());
    move_change_ = std::max(move_change_, (moved - moved_).norm());
    turn_change_ = std::max(turn_change_, (turned - turned_).norm());
    moved_ = moved;
    turned_ = turned;
    energy_ += from(wrench.force).dot(moved_) + from(wrench.torque).dot(turned_);
    if (!std::isfinite(energy_)) energy_ = 0;
  }
  pose_ = pose;
  placed_ = true;
}

// Takes energy from the hand along its motion. True when it changed the wrench.
bool HandPort::add_damper(Vec3& force, Vec3& torque, double max_force, double max_torque,
                          double dt) const {
  // The felt wrench acts on the hand, so its work leaves the engine.
  const double deficit = force.dot(moved_) + torque.dot(turned_) - energy_;
  // The ratio of the bounds is the lever that makes force and torque comparable.
  const double lever = max_torque / max_force;
  const double way = moved_.squaredNorm() + lever * lever * turned_.squaredNorm();
  if (!(deficit > 0) || !(way > kStill * kStill)) return false;
  const double damper = std::min(deficit / way, max_force / (kFullSpeed * dt));  // [N/m] in a frame
  const double force_bound = std::max(max_force, force.norm()),
               torque_bound = std::max(max_torque, torque.norm());
  force -= damper * moved_;
  torque -= damper * lever * lever * turned_;
  shorten(force, force_bound);
  shorten(torque, torque_bound);
  return true;
}

// The share of the wrench, 0 .. 1, with which the next motion cannot take more than the port has.
double HandPort::share_for(const Vec3& force, const Vec3& torque) const {
  const double out = force.dot(moved_) + torque.dot(turned_);
  // The next motion differs from the last one by up to the changes seen lately: the wrench then
  // takes out between out - 2 doubt and out + 2 doubt.
  const double doubt = 0.5 * (force.norm() * move_change_ + torque.norm() * turn_change_);
  if (energy_ >= std::max(out, 0.0) || out <= -2 * doubt) return 1;
  const double room = energy_ + doubt;
  return room > 0 ? room / (std::max(out, 0.0) + doubt) : 0;
}

bool HandPort::damp(h6Wrench& felt, double max_force, double max_torque, double dt) {
  if (!known_) return false;
  Vec3 force = from(felt.force), torque = from(felt.torque);
  bool changed = add_damper(force, torque, max_force, max_torque, dt);
  // Down at once, up slowly: a share that comes back in one frame is felt as a click, and would
  // follow a tremor up and down.
  share_ = std::min(share_for(force, torque), share_ + dt / kMemory);
  const double held = std::max(0.0, 1 - dt / kMemory);
  move_change_ *= held;
  turn_change_ *= held;
  if (share_ < 1) {
    force *= share_;
    torque *= share_;
    changed = true;
  }
  if (changed) felt = {to(force), to(torque)};
  return changed;
}

void observe_hand(h6Session& s, Hand& hand) {
  if (!hand.passivity || !hand.seen || hand.mode != H6_IMPEDANCE) return;
  const h6Wrench& f = hand.told;
  hand.port.move(hand.filter.device().pose,
                 {{-f.force.x, -f.force.y, -f.force.z}, {-f.torque.x, -f.torque.y, -f.torque.z}});
  const bool touching = touches(s, hand.body);
  if (hand.port.known() && (touching || !s.gravity.isZero(0))) return;
  const double stored = hand.filter.power_scale() * stored_energy(hand, s.bodies[hand.body]);
  hand.port.known() ? hand.port.spend(stored) : hand.port.start(stored);
}

bool damp_hand(h6Session& s, Hand& hand, h6Wrench& felt) {
  if (!hand.passivity || hand.clutched) return false;
  const double scale = hand.filter.force_scale();
  if (!hand.port.damp(felt, scale * hand.coupling.max_force, scale * hand.coupling.max_torque,
                      s.dt))
    return false;
  s.report.status |= H6_PASSIVITY;
  return true;
}

void note_command(h6Session&, Hand& hand, const h6DeviceCommand& command) {
  hand.told = command.wrench;
  if (!hand.passivity || hand.mode == H6_IMPEDANCE) return;
  if (!hand.port.known()) hand.port.start(0);
  hand.port.move(command.pose, hand.clutched ? h6Wrench{} : hand.filter.device().wrench);
}

double relief_for(const ReliefPower& power, double most) {
  const double excess = power.w0 - most;
  if (!(excess > 0) || !(power.w1 > 0)) return 0;
  const double root = power.w1 * power.w1 - 4 * power.w2 * excess;
  if (!(root > 0)) return power.w1 / (2 * power.w2);
  return 2 * excess / (power.w1 + std::sqrt(root));
}

void damp_contacts(h6Session& s) {
  for (std::size_t first = 0, end; first < s.pair_count; first = end) {
    end = pairs_of_shell(s, first);
    Body& body = s.bodies[s.pairs[first].a];
    ContactPort& port = body.contact_port;
    port.alpha = 0;
    bool touching = false;
    for (std::size_t p = first; p < end; ++p) {
      Pair& pair = s.pairs[p];
      pair.arm = body.x - s.bodies[pair.b].x;
      pair.u = relative(pair, velocity(body), velocity(s.bodies[pair.b]));
      touching = touching || !pair.f.isZero(0);
    }
    if (!touching) {
      // The contacts' damping dissipated any surplus: it must not pay for a later contact.
      port.energy = std::min(port.energy, 0.0);
      port.known = true;
      continue;
    }
    if (!port.known)
      port.energy = elastic_energy(s.contacts[s.pairs[first].a], s.contact.stiffness);
    port.known = true;
    const double most = port.energy / s.dt;
    const double left = relieve(s, first, end, most, Relief::damping);
    // One step may take a body in and throw it out; damping along its motion cannot undo that.
    if (s.integrator == H6_EXPLICIT && left > std::max(most, 0.0) + 1e-9 * std::abs(left))
      relieve(s, first, end, most, Relief::scaling);
  }
}

void observe_contacts(h6Session& s) {
  for (std::size_t p = 0; p < s.pair_count; ++p) {
    const Pair& pair = s.pairs[p];
    if (pair.f.isZero(0)) continue;
    const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
    ContactPort& port = s.bodies[pair.a].contact_port;
    const Vec6 u = relative(pair, velocity(a), velocity(b));
    Vec6 f = pair.f;
    // A body that a hand holds moves with the hand, under the unchanged wrench.
    if (s.integrator == H6_IMPLICIT && (free_mass(a) || free_mass(b)))
      f -= s.dt * (pair.B * u) + (s.contact.damping + port.alpha) * (pair.B * (u - pair.u));
    port.energy -= 0.5 * s.dt * f.dot(u + pair.u);
    if (!std::isfinite(port.energy)) port.energy = 0;
  }
}

void forget_energy(h6Session& s, std::int32_t body) {
  for (std::size_t p = 0; p < s.pair_count; ++p)
    if (s.pairs[p].a == body || s.pairs[p].b == body)
      s.bodies[s.pairs[p].a].contact_port.known = false;
  for (std::size_t h = 0; h < s.hand_count; ++h)
    if (s.hands[h].body == body) s.hands[h].port.forget();
}

double least_energy(const h6Session& s) {
  double least = HUGE_VAL;
  for (std::size_t h = 0; h < s.hand_count; ++h)
    if (s.hands[h].passivity) least = std::min(least, s.hands[h].port.energy());
  for (std::size_t p = 0; s.contact.passivity && p < s.pair_count; ++p)
    least = std::min(least, s.bodies[s.pairs[p].a].contact_port.energy);
  return least < HUGE_VAL ? least : 0;
}

}  // namespace h6
