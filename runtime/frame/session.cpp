// SPDX-License-Identifier: Apache-2.0
// session.cpp - makes a session from its definition: derives all values and reserves all memory, so
// that a frame need not.
#include "runtime/frame/session.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdio>
#include <new>

#include "runtime/contact/contact_stages.h"
#include "runtime/contact/friction.h"
#include "runtime/contact/weighing.h"
#include "runtime/frame/session_checks.h"
#include "runtime/frame/session_memory.h"
#include "runtime/frame/workers.h"
#include "sched/host_memory.h"

namespace h6 {
namespace {

// Each point has an equal share of the mass. If the points lie on a line or in one spot, the
// inertia of a ball of one voxel is added.
Mat3 inertia_of(const Shell& shell, const Vec3& com, double mass, double voxel) {
  Mat3 I = Mat3::Zero();
  for (std::size_t r = 0; r < shell.points; ++r) {
    const Vec3 p = Vec3(shell.x[r], shell.y[r], shell.z[r]) + shell.centre - com;
    I += mass / static_cast<double>(shell.points) *
         (p.squaredNorm() * Mat3::Identity() - p * p.transpose());
  }
  const double least = 0.4 * mass * voxel * voxel;
  if (Eigen::SelfAdjointEigenSolver<Mat3>(I, Eigen::EigenvaluesOnly).eigenvalues()[0] < least)
    I += least * Mat3::Identity();
  return I;
}

// The smallest voxel of the fields that each body can touch, and of its own field if others touch
// it [m].
sched::HostVector<double> voxels_of(const h6Model& model, const h6SessionDef& def,
                                    std::span<const h6PairDef> listed) {
  sched::HostVector<double> voxel(def.body_count, HUGE_VAL);
  each_pair(model, def, listed, [&](std::int32_t a, std::int32_t b) {
    const double finest = model.fields[def.bodies[b].field].finest;
    for (const std::int32_t i : {a, b})
      voxel[static_cast<std::size_t>(i)] = std::min(voxel[static_cast<std::size_t>(i)], finest);
  });
  return voxel;
}

// A default contact carries this many times the weight at a depth of one voxel, and has at least
// this natural frequency under any mass [rad/s] (METHOD.md, Sec. 4).
constexpr double kWeights = 4, kContactFrequency = 100;

// The default stiffness, and the part of it that sets the coupling's force: a heavy part wants a
// stiff wall, but no strong hand.
struct Stiffness {
  double contact, force;
};
// `voxels`: voxels_of, so that a body with a finite one is in some pair.
Stiffness stiffness_for(const h6SessionDef& def, std::span<const double> voxels) {
  if (def.contact.stiffness > 0) return {def.contact.stiffness, def.contact.stiffness};
  Stiffness k{kLeastStiffness, kLeastStiffness};
  for (std::size_t i = 0; i < def.body_count; ++i) {
    if (def.bodies[i].fixed || !(voxels[i] < HUGE_VAL)) continue;
    const double mass = def.bodies[i].mass;
    k.force = std::max(k.force, kWeights * mass * from(def.gravity).norm() / voxels[i]);
    k.contact = std::max({k.contact, k.force, kContactFrequency * kContactFrequency * mass});
  }
  return k;
}

void set_body(Body& body, const h6BodyDef& def, double voxel) {
  body.fixed = def.fixed;
  body.mass = def.mass;
  body.com = from(def.com);
  body.voxel = voxel;
  if (const Shell* shell = body.shell)
    for (std::size_t r = 0; r < shell->points; ++r)
      body.radius =
          std::max(body.radius,
                   (Vec3(shell->x[r], shell->y[r], shell->z[r]) + shell->centre - body.com).norm());
  const double* v = def.inertia;
  body.inertia << v[0], v[3], v[4], v[3], v[1], v[5], v[4], v[5], v[2];
  body.translation_only = def.translation_only;
  if (!body.fixed && body.inertia.isZero(0))
    body.inertia = body.shell  // without a shell the body never turns, and any inertia will do
                       ? inertia_of(*body.shell, body.com, body.mass, body.voxel)
                       : Mat3(body.mass * body.voxel * body.voxel * Mat3::Identity());
  set_mesh_pose(body, def.pose);
  body.v = from(def.velocity.linear);
  body.w = from(def.velocity.angular);
  if (body.fixed) body.v.setZero(), body.w.setZero();
  if (body.translation_only) body.w.setZero();
}

// The damping of a free body that a person pushes, unless the definition sets it (METHOD.md,
// Sec. 4): a grip of 1500 N/m behind 5 ms of delay removes 7.5 N s/m.
double admittance_damping(const h6HandDef& def, double mass) {
  return def.admittance_damping > 0 ? def.admittance_damping : std::max(mass / 0.02, 10.0);
}

// Turning as fast as the body moves, for any size of the body.
double default_rotational_stiffness(double k, const Body& body) {
  const double lever2 = 900 * body.voxel * body.voxel;
  return k * std::max(lever2, body.inertia.trace() / (3 * body.mass));
}

// Dynamic coupling: a light body has no inertia that would keep it from jumping when a contact
// comes or goes, so its damper is at least this many frames times its spring, up to one frame times
// the contacts' stiffness, which would stop it in a frame (METHOD.md, Sec. 4). Rotation gets the
// same share more.
constexpr double kLightFrames = 10;

double more_damping(const Settings& set, const h6CouplingDef& c, double mass) {
  if (set.integrator == H6_EXPLICIT) return 1;  // an explicit step could not hold it
  const double least = set.dt * std::min(kLightFrames * c.stiffness, set.contact.stiffness);
  return std::max(1.0, least / (2 * std::sqrt(c.stiffness * mass)));
}

// Static coupling: a damper of this many frames times its spring, for a damping ratio of 1. It pays
// for the delay of a loop whose commands come two frames late (METHOD.md, Sec. 4).
constexpr double kLagFrames = 3;

void set_hand(const Settings& set, double force_stiffness, Hand& hand, HandDevice& device,
              Body& body, const h6HandDef& def) {
  hand.body = def.body;
  hand.mode = def.mode;
  hand.manipulandum_mass = def.manipulandum_mass;
  hand.driver_stiffness = def.driver_stiffness;
  hand.driver_damping = def.driver_damping;
  device.motion_scale = def.filter.motion_scale;
  device.rotation_scale = def.filter.rotation_scale;
  // A body that never turns is held at the origin of its mesh frame.
  const Vec3 com = body.translation_only ? Vec3(Vec3::Zero()) : body.com;
  device.filter.set(def.filter, com, def.mode != H6_IMPEDANCE);
  device.safety = def.safety;
  h6DeviceCapabilities unknown{};
  unknown.max_force = SafetyLimits{}.force, unknown.max_torque = SafetyLimits{}.torque;
  unknown.frame_time = true;
  set_rating(device, unknown);
  device.passivity = def.passivity;
  device.port.set(com);
  device.port.set_delay(def.delay_frames, def.delay_known);
  h6CouplingDef& c = hand.coupling = def.coupling;
  if (c.rotational_stiffness == 0)
    c.rotational_stiffness = default_rotational_stiffness(c.stiffness, body);
  if (c.max_force == 0) c.max_force = force_stiffness * c.max_depth_voxels * body.voxel;
  if (c.max_torque == 0)
    c.max_torque = c.max_force * (body.radius > 0 ? body.radius : 30 * body.voxel);
  if (hand.mode == H6_ADMITTANCE) body.drag += admittance_damping(def, body.mass);
  if (c.mode == H6_COUPLING_STATIC) body.motion = Motion::quasi_static;
  if (c.mode == H6_COUPLING_DIRECT) body.motion = Motion::held;
  body.max_step = c.max_step_voxels * body.voxel;
  body.lag = c.damping_ratio * kLagFrames * set.dt;
  if (c.mode == H6_COUPLING_DYNAMIC) c.damping_ratio *= more_damping(set, c, body.mass);
  if (body.motion != Motion::dynamic) body.v.setZero(), body.w.setZero();
  hand.manipulandum = body;
}

// Moving bodies that pairs connect, in groups of at most four. A larger group is split into single
// bodies; within a step each treats its neighbours as fixed. Quasi-static and held bodies have no
// mass of their own and are in no island.
sched::HostVector<Island> islands_of(const h6Model& model, std::span<const Body> bodies,
                                     const h6SessionDef& def, std::span<const h6PairDef> listed) {
  const auto dynamic = [&](std::int32_t i) {
    return !bodies[i].fixed && bodies[i].motion == Motion::dynamic;
  };
  sched::HostVector<std::int32_t> root(bodies.size());
  for (std::size_t i = 0; i < root.size(); ++i) root[i] = static_cast<std::int32_t>(i);
  const auto find = [&](std::int32_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  each_pair(model, def, listed, [&](std::int32_t a, std::int32_t b) {
    if (dynamic(a) && dynamic(b)) root[find(b)] = find(a);
  });
  sched::HostVector<sched::HostVector<std::int32_t>> members(bodies.size());
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(root.size()); ++i)
    if (dynamic(i)) members[find(i)].push_back(i);
  sched::HostVector<Island> islands;
  for (const sched::HostVector<std::int32_t>& group : members) {
    if (group.size() <= kIslandBodies && !group.empty()) {
      Island island{{}, static_cast<int>(group.size())};
      std::copy(group.begin(), group.end(), island.body);
      islands.push_back(island);
    } else {
      for (const std::int32_t i : group) islands.push_back({{i}, 1});
    }
  }
  return islands;
}

bool offset_fits(const h6SessionDef& def, double voxel, std::int32_t body, h6Error* error) {
  const double offset = def.contact.fit_offset / voxel;
  return offset <= H6_DEEPEST_FIT ||
         fail(error, "contact fit_offset is %g mm, which is %.1f voxels of body %d: at most %g",
              1e3 * def.contact.fit_offset, offset, body, H6_DEEPEST_FIT);
}

bool offsets_fit(const h6Model& model, const h6SessionDef& def, std::span<const h6PairDef> listed,
                 h6Error* error) {
  bool fits = true;
  if (def.contact.fit_offset > 0)
    each_pair(model, def, listed, [&](std::int32_t, std::int32_t b) {
      fits = fits && offset_fits(def, model.fields[def.bodies[b].field].voxel, b, error);
    });
  return fits;
}

// Sec. 10 of METHOD.md says why these do not go with a body that bends.
bool bends_fit(const h6Session& s, const h6SessionDef& def, h6Error* error) {
  const h6ContactDef& c = def.contact;
  const char* const no = c.friction > 0                  ? "contact friction"
                         : c.passivity                   ? "contact passivity"
                         : uses_clusters(c)              ? "clusters of contacts"
                         : def.integrator == H6_EXPLICIT ? "the explicit integrator"
                         : def.frame_budget_us > 0       ? "a frame budget"
                                                         : nullptr;
  for (const Deformation& d : s.bends) {
    const Body& body = s.bodies[d.body];
    if (no) return fail(error, "body %d bends, and %s cannot be used with it", d.body, no);
    if (!def.bodies[d.body].fixed)
      return fail(error, "body %d bends and must be fixed: only rigid bodies move", d.body);
    if (body.field)
      return fail(error,
                  "body %d bends and cannot have a field, which would stay as it is at rest: give "
                  "the field to the rigid body",
                  d.body);
  }
  return true;
}

// Finds the body that each body that bends may touch: one at most, whose centre of mass its arms
// begin at, and whose size they have.
bool join_partners(h6Session& s, const h6SessionDef& def, std::span<const h6PairDef> listed,
                   h6Error* error) {
  std::int32_t two = -1;
  each_pair(*s.model, def, listed, [&](std::int32_t a, std::int32_t b) {
    Deformation* const d = s.bodies[a].bend;
    if (d && d->partner >= 0) two = a;
    if (d) d->partner = b;
  });
  if (two >= 0)
    return fail(error,
                "body %d bends and may touch the fields of several bodies: list one pair with it",
                two);
  for (Deformation& d : s.bends) {
    Body& a = s.bodies[d.body];
    if (d.partner >= 0) {
      const Body& b = s.bodies[d.partner];
      a.radius = b.shell && !b.bend ? b.radius + 2 * a.voxel : farthest(b.field->box, b.com);
    }
    follow(d, s.bodies);
  }
  return true;
}

bool fill(h6Session& s, const h6SessionDef& def, h6Error* error) {
  const Turn turn(def.workers);
  if (!turn) return fail(error, H6_ERROR_BUSY, "the session's workers are stepping others");
  const sched::HostVector<h6PairDef> listed = sorted_pairs(def);
  if (!offsets_fit(*s.model, def, listed, error) || !reserve_memory(s, def, listed, error))
    return false;
  const sched::HostVector<double> voxels = voxels_of(*s.model, def, listed);
  for (std::size_t i = 0; i < s.bodies.size(); ++i)
    set_body(s.bodies[i], def.bodies[i], voxels[i] < HUGE_VAL ? voxels[i] : 1e-3);
  if (!bends_fit(s, def, error) || !join_partners(s, def, listed, error)) return false;
  const Stiffness k = stiffness_for(def, voxels);
  s.settings.contact.stiffness = k.contact;
  for (std::size_t i = 0; i < s.hands.size(); ++i)
    set_hand(s.settings, k.force, s.hands[i], s.devices[i], s.bodies[def.hands[i].body],
             def.hands[i]);
  const sched::HostVector<Island> islands = islands_of(*s.model, s.bodies, def, listed);
  s.islands = s.islands.first(islands.size());
  std::copy(islands.begin(), islands.end(), s.islands.begin());
  s.team = create<sched::FrameTeam>(s.allocator, def.threads, def.tasks);
  s.alone = create<sched::FrameTeam>(s.allocator, 1);
  if (!s.team || !s.alone) throw std::bad_alloc();
  open_lanes(s.lanes, s.team, s.alone, &s.anytime);
  open_near_pairs(s);
  return measure_overlap(s, error);
}

// Overlaps are no error, but a program that knows nothing of them is surprised by its contacts.
void log_overlaps(const h6Session& s) {
  for (std::size_t i = 0; i < s.overlap.pair_count; ++i) {
    const h6Overlap& o = s.overlap.pairs[i];
    char text[160];
    std::snprintf(text, sizeof text,
                  "body %d starts %.3g voxels deep in body %d, with %u points: h6GetOverlaps tells "
                  "more",
                  o.shell_body, o.depth_voxels, o.field_body, o.points);
    h6Log(H6_LOG_NOTE, text);
  }
}

}  // namespace
}  // namespace h6

namespace h6 {

void fault_all(h6Session& s, h6Cause cause) {
  for (HandDevice& device : s.devices) device.guard.fault(cause);
}

void disarm_all(h6Session& s) {
  for (HandDevice& device : s.devices) device.guard.disarm();
}

void take_asked(h6Session& s) {
  if (s.asked.load(std::memory_order_relaxed) == 0) return;
  const std::uint32_t asked = s.asked.exchange(0);
  if (asked & kAskDisarm) disarm_all(s);
  for (std::uint32_t cause = 1; cause < H6_CAUSE_COUNT; ++cause)
    if (asked >> cause & 1) fault_all(s, static_cast<h6Cause>(cause));
}

}  // namespace h6

using namespace h6;

extern "C" {

double h6StiffnessFor(const h6Model* model, const h6SessionDef* def) {
  h6Error error;
  try {
    if (!model || !def || !check_session(*model, *def, &error)) return 0;
    return stiffness_for(*def, voxels_of(*model, *def, sorted_pairs(*def))).contact;
  } catch (const std::exception&) {  // no memory for the pairs
    return 0;
  }
}

h6Session* h6CreateSession(const h6Model* model, const h6SessionDef* def, h6Error* error) {
  if (!model || !def) return fail(error, "a session needs a model and a definition"), nullptr;
  const sched::HostScope scope(def->allocator);
  try {
    if (!check_session(*model, *def, error)) return nullptr;
  } catch (const std::exception&) {  // to compare the pairs
    return fail(error, H6_ERROR_MEMORY, "no memory for a session"), nullptr;
  }
  h6Session* s = create<h6Session>(def->allocator);
  if (!s) return fail(error, H6_ERROR_MEMORY, "no memory for a session"), nullptr;
  s->model = model;
  s->allocator = def->allocator;
  s->workers = def->workers;
  s->owner = idle_owner(*s);
  s->settings = {.contact = def->contact,
                 .integrator = def->integrator,
                 .gradient = def->gradient,
                 .dt = 1 / def->rate,
                 .gravity = from(def->gravity),
                 .net_stiffness = def->net_stiffness,
                 .max_contacts = def->max_contacts,
                 .max_substeps = def->max_substeps};
  s->anytime.budget_ns = 1e3 * def->frame_budget_us;
  s->anytime.period_ns = 1e9 * s->settings.dt;
  bool ready = false;
  try {
    ready = fill(*s, *def, error);
  } catch (const std::bad_alloc&) {  // from small tables
    fail(error, H6_ERROR_MEMORY, "no memory for a session");
  } catch (const std::exception& e) {  // from threads
    fail(error, H6_ERROR_SYSTEM, "the session could not be made: %s", e.what());
  }
  s->tick_length.see(sched::now_ns(), sched::ticks());
  if (ready) return log_overlaps(*s), s;
  h6DestroySession(s);
  return nullptr;
}

void h6DestroySession(h6Session* s) {
  if (!s) return;
  destroy(s->allocator, s->team);
  destroy(s->allocator, s->alone);
  forget_overlap(*s);
  release_memory(*s);
  const h6Allocator allocator = s->allocator;
  destroy(allocator, s);
}

}  // extern "C"
