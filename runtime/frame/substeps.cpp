// SPDX-License-Identifier: Apache-2.0
// substeps.cpp - bounds the motion of points relative to the fields that they are near.
#include "runtime/frame/substeps.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "runtime/contact/traverse_pair.h"
#include "runtime/frame/session.h"
#include "runtime/motion/motion_stages.h"

namespace h6 {
namespace {

bool is_free(const Body& body) { return !body.fixed && body.motion == Motion::dynamic; }

// A bound on the motion of a pair's points against its field, from a shift of a's centre of mass
// against b's frame and a turn [m].
double reach(const Body& a, double shift, double turn) { return shift + turn * a.radius; }

// The motion that the velocities of free bodies make in `dt` seconds [m].
double free_motion(const Body& a, const Body& b, double dt) {
  Vec3 v = Vec3::Zero(), w = Vec3::Zero();
  if (is_free(a)) v = a.v, w = a.w;
  if (is_free(b)) v -= b.v + b.w.cross(arm_origin(a) - b.x), w -= b.w;
  const double way = dt * reach(a, v.norm(), w.norm());
  return a.bend ? way + a.bend->pace : way;
}

// The motion that the hands of held bodies make in this frame [m].
double held_motion(const h6Session& s, const Pair& pair) {
  const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  double way = 0;
  for (const Hand& hand : s.hands) {
    const Body& body = s.bodies[hand.body];
    if (body.motion != Motion::held || !hand.seen) continue;
    const Way of = way_of(hand, body);
    if (hand.body == pair.a) way += reach(a, of.shift, of.turn);
    if (hand.body == pair.b)
      way += reach(a, of.shift + of.turn * (arm_origin(a) - b.x).norm(), of.turn);
  }
  return way;
}

// The speed that this body's points gain in a frame if it gains as much as in the last one, as far
// away as the pair's points are [m/s].
double gain(const Body& body, const Body& a) {
  if (!is_free(body)) return 0;
  const double lever = (a.x - body.x).norm() + a.radius;
  return body.gained_v.norm() + body.gained_w.norm() * lever;
}

// The longest step near a field [its voxel].
double longest_step(const Field& field) { return kLongestStep * field.finest / field.voxel; }

// How far the pair's points may go in one step if they would go `way` [voxel].
double allowed(h6Session& s, const Pair& pair, double way) {
  const double longest = longest_step(*s.bodies[pair.b].field);
  if (way <= longest) return way;
  const double clear = clearance(s.settings, s.bodies[pair.a], s.bodies[pair.b], way, longest,
                                 pair.search.touched, s.lanes.scratch[0].traverse);
  return std::min(way, std::max(clear, longest));
}

// Notes how far the points of each body may move in `dt` seconds. `share`: of the ways of the hands
// of held bodies. `gains`: free bodies gain as much speed as in the last frame.
void note_reach(h6Session& s, double dt, double share, bool gains) {
  for (const std::uint32_t i : s.near.all_lively()) {
    const Body& body = s.bodies[i];
    BodyPlace& place = s.near.places[i];
    place.reach = body.bend ? body.bend->pace : 0;
    if (!is_free(body)) continue;
    place.reach = dt * (body.v.norm() + body.w.norm() * place.radius);
    if (gains) place.reach += dt * (body.gained_v.norm() + body.gained_w.norm() * place.radius);
  }
  for (const Hand& hand : s.hands) {
    const Body& body = s.bodies[hand.body];
    if (body.motion != Motion::held || !hand.seen) continue;
    BodyPlace& place = s.near.places[hand.body];
    const Way way = way_of(hand, body);
    place.reach += share * (way.shift + way.turn * place.radius);
  }
}

void forget_reach(h6Session& s) {
  for (const std::uint32_t i : s.near.all_lively()) s.near.places[i].reach = 0;
}

// Whether points of the pair can reach its field at all within the noted ways.
bool within_reach(const h6Session& s, const Pair& pair) {
  const BodyPlace &a = s.near.places[pair.a], &b = s.near.places[pair.b];
  return overlap(grown(a.shell, a.reach + b.reach), b.field);
}

// An explicit step may be this share of the longest one that is stable.
constexpr double kExplicitShare = 0.7;

// The explicit steps of `dt` in all that an inertia m needs on a spring k with a damper b:
// symplectic Euler is stable where k h^2 + 2 b h < 4 m.
double explicit_steps(double m, double k, double b, double dt) {
  const double limit = 4 * kExplicitShare * m;
  return dt * (b + std::sqrt(b * b + limit * k)) / limit;
}

// The steps that a free body needs under its hands and one wall of the contacts' stiffness. They do
// not depend on the rule, because explicit steps show how much stiffer than one wall a rule is.
double explicit_steps(const h6Session& s, std::size_t body) {
  const Body& b = s.bodies[body];
  const h6ContactDef& contact = s.settings.contact;
  const double wall = contact.stiffness, turned_wall = wall * b.radius * b.radius;
  double k = wall, damper = contact.damping * wall;
  double turn_k = turned_wall, turn_damper = contact.damping * turned_wall;
  for (const Hand& hand : s.hands) {
    if (static_cast<std::size_t>(hand.body) != body || hand.mode == H6_ADMITTANCE) continue;
    const h6CouplingDef& c = hand.coupling;
    k += c.stiffness, turn_k += c.rotational_stiffness;
    damper += coupling_damper(c, c.stiffness, b.mass);
    turn_damper += coupling_damper(c, c.rotational_stiffness, mean_inertia(b));
  }
  const double dt = s.settings.dt, shift = explicit_steps(b.mass, k, damper, dt);
  if (b.translation_only) return shift;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(b.inertia, Eigen::EigenvaluesOnly);
  return std::max(shift, explicit_steps(axes.eigenvalues()[0], turn_k, turn_damper, dt));
}

Substeps plan_explicit(const h6Session& s) {
  double needed = 1;
  for (std::size_t i = 0; i < s.bodies.size(); ++i)
    if (is_free(s.bodies[i])) needed = std::max(needed, std::ceil(explicit_steps(s, i)));
  // Where the budget is too small the step is only too long: no hand must stay behind its way.
  const double count = std::min<double>(needed, s.settings.max_substeps);
  return {static_cast<std::uint32_t>(count), count};
}

}  // namespace

Substeps plan_substeps(h6Session& s) {
  if (s.settings.max_substeps == 1) return {};
  if (s.settings.integrator == H6_EXPLICIT) return plan_explicit(s);
  for (Deformation& d : s.bends) d.pace = s.settings.dt * bend_way(d, d.v);
  note_reach(s, s.settings.dt, 1, true);
  find_near_pairs(s);
  double needed = 1;
  for (const NearPairs::Near& near : s.near.all_near()) {
    const Pair& pair = s.near.pairs[near.slot];
    const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
    const double dt = s.settings.dt;
    const double way =
        (free_motion(a, b, dt) + dt * (gain(a, a) + gain(b, a)) + held_motion(s, pair)) /
        b.field->voxel;
    const double longest = longest_step(*b.field);
    if (way > needed * longest && within_reach(s, pair) && allowed(s, pair, way) < way)
      needed = std::ceil(way / longest);
  }
  forget_reach(s);
  for (const std::uint32_t i : s.near.all_lively())
    s.bodies[i].gained_v.setZero(), s.bodies[i].gained_w.setZero();
  const double most = s.settings.max_substeps;
  return {static_cast<std::uint32_t>(std::min(needed, most)), needed};
}

double share_of_way(const Substeps& plan, bool held, std::uint32_t i) {
  return (i + 1) / (held ? plan.needed : plan.count);
}

bool slow_down(h6Session& s, double dt) {
  if (s.settings.max_substeps == 1 || s.settings.integrator == H6_EXPLICIT) return false;
  for (Deformation& d : s.bends) d.pace = bend_way(d, d.step);
  note_reach(s, dt, 1 / s.substeps.needed, false);
  find_near_pairs(s);
  double share = 1;
  for (const NearPairs::Near& near : s.near.all_near()) {
    const Pair& pair = s.near.pairs[near.slot];
    const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
    const double held = held_motion(s, pair) / s.substeps.needed;
    const double moved = free_motion(a, b, dt) / b.field->voxel;
    const double way = moved + held / b.field->voxel;
    const double longest = longest_step(*b.field);
    if (!(way > longest && moved > 0 && within_reach(s, pair))) continue;
    // This step found the contacts at the present poses: a pair that touches need not be searched.
    const double may = pair.awake && pair.touches ? longest : allowed(s, pair, way);
    share = std::min(share, std::max(0.0, 1 - (way - may) / moved));
  }
  forget_reach(s);
  if (!(share < 1)) return false;
  for (const std::uint32_t i : s.near.all_lively()) {
    Body& body = s.bodies[i];
    if (is_free(body)) body.v *= share, body.w *= share;
  }
  for (Deformation& d : s.bends)
    for (int j = 0; j < d.modes; ++j) d.step[j] *= share, d.next_v[j] *= share;
  return true;
}

}  // namespace h6
