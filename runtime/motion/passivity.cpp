// SPDX-License-Identifier: Apache-2.0
// passivity.cpp - observes the energy of hands and contacts and keeps it from going below zero.
#include "runtime/motion/passivity.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/contact_stages.h"
#include "runtime/motion/motion_stages.h"

namespace h6 {
namespace {

// The hand's damper is at most the one that reaches the coupling's bound at this speed [m/s].
// Without a limit it would take any value at the speeds of an encoder's noise, where the motion by
// which the deficit is divided is almost zero.
constexpr double kFullSpeed = 0.05;
constexpr double kStill = 1e-9;  // a smaller motion in a frame has no direction [m]
// The share rises from 0 to 1 in this time, and peaks of change in the motion fade as slowly [s].
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

// The mean velocity in the coming step. For an explicit step it is exact but for gyroscopic terms.
// For an implicit step it is the present velocity, which overestimates the energy that the contacts
// will give out.
Vec6 mean_velocity(const Settings& set, const Body& body, const LinearWrench& acting) {
  Vec6 u = velocity(body);
  if (set.integrator == H6_EXPLICIT && free_mass(body))
    u += 0.5 * set.dt * accelerated_by(body, acting.f);
  return u;
}

// Adds the power that the wrench F - alpha c of the contacts gives one body in the coming step.
// `u`: the body's mean velocity.
void add_power(const Settings& set, const Body& body, const Vec6& u, const Vec6& F, const Vec6& c,
               ReliefPower& power) {
  power.w0 += F.dot(u);
  power.w1 += c.dot(u);
  if (set.integrator != H6_EXPLICIT || !free_mass(body)) return;
  const Vec6 g = 0.5 * set.dt * accelerated_by(body, c);
  power.w1 += F.dot(g);
  power.w2 += c.dot(g);
}

// At most about the energy in the springs of a frame's contacts [J]: under `firm` a spring that
// stiffens holds less than half of its load times its depth.
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

// Subtracts f from the pair's wrench on a. A hand that holds a body carries the whole wrench on it.
void take_away(std::span<const Body> bodies, const Sides& sides, Pair& pair, const Vec6& f,
               std::span<Hand> hands) {
  const Vec6 on_b = arm_shift(sides.a, sides.b) * f;
  pair.f -= f;
  if (!sides.a.fixed) sides.on_a.f -= f;
  if (!sides.b.fixed) sides.on_b.f += on_b;
  for (Hand& hand : hands) {
    if (bodies[hand.body].motion != Motion::held || hand.mode != H6_IMPEDANCE) continue;
    if (hand.body == pair.a) hand.wrench += f;
    if (hand.body == pair.b) hand.wrench -= on_b;
  }
}

void add_damping(const Sides& sides, Pair& pair, double alpha) {
  const Mat6 S = arm_shift(sides.a, sides.b), D = alpha * pair.B;
  if (!sides.a.fixed) sides.on_a.D -= D;
  if (!sides.b.fixed) sides.on_b.D -= S * D * S.transpose();
  if (!pair.between) return;
  pair.between->Dab += D * S.transpose();
  pair.between->Dba += S * D;
}

enum class Relief { damping, scaling };

// Reduces the wrenches of one shell body's contacts as little as possible, so that they give out at
// most `most` [W]: by damping along their motion, or by scaling all of them. Returns the power that
// they then give out [W].
double relieve(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
               std::span<LinearWrench> acting, std::span<Hand> hands, double most, Relief by,
               h6Status& status) {
  const Body& a = bodies[shell.body];
  const Vec6 ua = mean_velocity(set, a, acting[shell.body]);
  Vec6 F = Vec6::Zero(), c = Vec6::Zero();
  ReliefPower power;
  for (Pair& pair : shell.pairs) {
    if (pair.f.isZero(0)) continue;
    const Body& b = bodies[pair.b];
    const Vec6 ub = mean_velocity(set, b, acting[pair.b]);
    pair.relief = by == Relief::scaling ? pair.f : Vec6(pair.B * relative(pair, ua, ub));
    F += pair.f;
    c += pair.relief;
    const Mat6 S = arm_shift(a, b);
    add_power(set, b, ub, -S * pair.f, -S * pair.relief, power);
  }
  add_power(set, a, ua, F, c, power);
  if (power.w0 <= most) return power.w0;
  // Contacts that give out power may be reduced to giving out none, but no further: together they
  // must never pull.
  const double alpha = relief_for(power, power.w0 > 0 ? std::max(most, 0.0) : most);
  if (!(alpha > 0)) return power.w0;
  for (Pair& pair : shell.pairs) {
    if (pair.f.isZero(0)) continue;
    const Sides sides = sides_of(pair, bodies, acting);
    take_away(bodies, sides, pair, alpha * pair.relief, hands);
    if (by == Relief::damping) add_damping(sides, pair, alpha);
  }
  if (by == Relief::damping) shell.port.alpha = alpha;
  status |= H6_PASSIVITY;
  return power.w0 - alpha * power.w1 + alpha * alpha * power.w2;
}

// The energy of a spring of stiffness k whose force is at most `most` [J].
double spring_energy(double k, double stretch, double most) {
  const double knee = most / k;
  return stretch <= knee ? 0.5 * k * stretch * stretch : most * (stretch - 0.5 * knee);
}

// The energy that a hand's coupling and body hold while the body touches nothing [J].
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

bool touches(std::span<const ShellBody> shells, std::int32_t body) {
  for (const ShellBody& shell : shells)
    for (const Pair& pair : shell.pairs)
      if ((pair.a == body || pair.b == body) && !pair.f.isZero(0)) return true;
  return false;
}

}  // namespace

void HandPort::move(const h6Pose& pose, std::span<const h6Wrench> wrenches) {
  if (placed_) {
    const Quat q = from(pose.q), before = from(pose_.q);
    const Vec3 moved = from(pose.p) + q * com_ - from(pose_.p) - before * com_,
               turned = log_rotation(q * before.conjugate());
    move_change_ = std::max(move_change_, (moved - moved_).norm());
    turn_change_ = std::max(turn_change_, (turned - turned_).norm());
    moved_ = moved;
    turned_ = turned;
    double least = HUGE_VAL;
    for (const h6Wrench& w : wrenches)
      least = std::min(least, from(w.force).dot(moved_) + from(w.torque).dot(turned_));
    energy_ += least;
    if (!std::isfinite(energy_)) energy_ = 0;
  }
  pose_ = pose;
  placed_ = true;
}

void HandPort::move(const h6Pose& pose) {
  h6Wrench acted[kMostDelay + 1];
  std::size_t count = 0;
  for (std::uint32_t i = known_delay_ ? delay_ : 0; i <= delay_; ++i) {
    const h6Wrench& f = sent_[i];
    acted[count++] = {{-f.force.x, -f.force.y, -f.force.z},
                      {-f.torque.x, -f.torque.y, -f.torque.z}};
  }
  move(pose, {acted, count});
}

void HandPort::sent(const h6Wrench& felt) {
  for (std::uint32_t i = kMostDelay; i > 0; --i) sent_[i] = sent_[i - 1];
  sent_[0] = felt;
}

HandPort::Outlook HandPort::outlook(const Vec3& force, const Vec3& torque) const {
  return {force.dot(moved_) + torque.dot(turned_),
          0.5 * (force.norm() * move_change_ + torque.norm() * turn_change_)};
}

// E less what the commands on their way to the hand may still take out.
double HandPort::available() const {
  double left = energy_;
  for (std::uint32_t i = 0; i < delay_; ++i) {
    const Outlook o = outlook(from(sent_[i].force), from(sent_[i].torque));
    left -= std::max(0.0, o.out + 2 * (delay_ - i) * o.doubt);
  }
  return left;
}

bool HandPort::damp(h6Wrench& felt, double max_force, double max_torque, double dt) {
  frame_ = dt;
  if (!known_) return false;
  Vec3 force = from(felt.force), torque = from(felt.torque);
  // The felt wrench acts on the hand, so its work leaves the engine.
  const double deficit = outlook(force, torque).out - available();
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
  felt = {to(force), to(torque)};
  return true;
}

// The share of the wrench, 0 .. 1, with which the motion that it meets cannot take out more than
// the port has by then.
double HandPort::share_for(const Vec3& force, const Vec3& torque) const {
  const Outlook o = outlook(force, torque);
  const double has = available();
  // That motion differs from the last one by up to the changes seen lately, in every frame until
  // then: the wrench takes out between out - 2 doubt and out + 2 doubt times these frames.
  if (has >= std::max(o.out, 0.0) || o.out <= -2.0 * (1 + delay_) * o.doubt) return 1;
  const double room = has + o.doubt;
  return room > 0 ? room / (std::max(o.out, 0.0) + o.doubt) : 0;
}

double HandPort::share(const Vec3& force, const Vec3& torque) {
  if (!known_) return 1;
  // The share falls at once and rises slowly. A share that rises in one frame is felt as a click,
  // and it would follow a tremor up and down.
  share_ = std::min(share_for(force, torque), share_ + frame_ / kMemory);
  const double held = std::max(0.0, 1 - frame_ / kMemory);
  move_change_ *= held;
  turn_change_ *= held;
  return share_;
}

void observe_hand(const Settings& set, std::span<const Body> bodies,
                  std::span<const ShellBody> shells, const Hand& hand, HandDevice& device) {
  if (!device.passivity || !hand.seen || hand.mode != H6_IMPEDANCE) return;
  HandPort& port = device.port;
  port.move(device.filter.device().pose);
  const bool touching = touches(shells, hand.body);
  if (port.known() && (touching || !set.gravity.isZero(0))) return;
  const double stored = device.filter.power_scale() * stored_energy(hand, bodies[hand.body]);
  port.known() ? port.spend(stored) : port.start(stored);
}

bool damp_hand(HandDevice& device, const Hand& hand, h6Wrench& felt, double dt) {
  if (!device.passivity || hand.clutched) return false;
  const double scale = device.filter.force_scale();
  return device.port.damp(felt, scale * hand.coupling.max_force, scale * hand.coupling.max_torque,
                          dt);
}

void note_command(HandDevice& device, const Hand& hand, const h6DeviceCommand& command) {
  device.port.sent(command.wrench);
  if (!device.passivity || hand.mode == H6_IMPEDANCE) return;
  if (!device.port.known()) device.port.start(0);
  device.port.move(command.pose, hand.clutched ? h6Wrench{} : device.filter.device().wrench);
}

double relief_for(const ReliefPower& power, double most) {
  const double excess = power.w0 - most;
  if (!(excess > 0) || !(power.w1 > 0)) return 0;
  const double root = power.w1 * power.w1 - 4 * power.w2 * excess;
  if (!(root > 0)) return power.w1 / (2 * power.w2);
  return 2 * excess / (power.w1 + std::sqrt(root));
}

void damp_contacts(const Settings& set, std::span<const Body> bodies, std::span<ShellBody> shells,
                   std::span<LinearWrench> acting, std::span<Hand> hands, h6Status& status) {
  for (ShellBody& shell : shells) {
    const Body& a = bodies[shell.body];
    ContactPort& port = shell.port;
    port.alpha = 0;
    bool touching = false;
    for (Pair& pair : shell.pairs) {
      const Body& b = bodies[pair.b];
      pair.arm = a.x - b.x;
      pair.u = relative(pair, velocity(a), velocity(b));
      touching = touching || !pair.f.isZero(0);
    }
    if (!touching) {
      // Energy left over from one contact must not pay for a later one.
      port.energy = std::min(port.energy, 0.0);
      port.known = true;
      continue;
    }
    if (!port.known) port.energy = elastic_energy(shell.contacts, set.contact.stiffness);
    port.known = true;
    const double most = port.energy / set.dt;
    const double left = relieve(set, bodies, shell, acting, hands, most, Relief::damping, status);
    // An explicit step may take a body in and throw it out again. Damping along its motion cannot
    // undo that.
    if (set.integrator == H6_EXPLICIT && left > std::max(most, 0.0) + 1e-9 * std::abs(left))
      relieve(set, bodies, shell, acting, hands, most, Relief::scaling, status);
  }
}

void observe_contacts(const Settings& set, std::span<const Body> bodies,
                      std::span<ShellBody> shells) {
  for (ShellBody& shell : shells) {
    const Body& a = bodies[shell.body];
    ContactPort& port = shell.port;
    for (const Pair& pair : shell.pairs) {
      if (pair.f.isZero(0)) continue;
      const Body& b = bodies[pair.b];
      const Vec6 u = relative(pair, velocity(a), velocity(b));
      Vec6 f = pair.f;
      // The hand moves a body that it holds, so the wrench there does not change with the step.
      if (set.integrator == H6_IMPLICIT && (free_mass(a) || free_mass(b)))
        f -= set.dt * (pair.B * u) + (set.contact.damping + port.alpha) * (pair.B * (u - pair.u));
      port.energy -= 0.5 * set.dt * f.dot(u + pair.u);
      if (!std::isfinite(port.energy)) port.energy = 0;
    }
  }
}

double least_energy(const Settings& set, std::span<const ShellBody> shells,
                    std::span<const HandDevice> devices) {
  double least = HUGE_VAL;
  for (const HandDevice& device : devices)
    if (device.passivity) least = std::min(least, device.port.energy());
  if (set.contact.passivity)
    for (const ShellBody& shell : shells) least = std::min(least, shell.port.energy);
  return least < HUGE_VAL ? least : 0;
}

}  // namespace h6
