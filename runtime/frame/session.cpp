// SPDX-License-Identifier: Apache-2.0
// session.cpp - from a definition to a session: everything is derived, sized and reserved here, so
// that a frame has nothing left to decide.
#include "runtime/frame/session.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <new>
#include <vector>

#include "runtime/frame/session_checks.h"
#include "runtime/frame/stages.h"
#include "runtime/frame/weighing.h"

namespace h6 {
namespace {

std::vector<h6PairDef> pairs_of(const h6SessionDef& def) {
  std::vector<h6PairDef> pairs(def.pairs, def.pairs + def.pair_count);
  if (pairs.empty()) {
    const auto count = static_cast<std::int32_t>(def.body_count);
    for (std::int32_t a = 0; a < count; ++a)
      for (std::int32_t b = 0; b < count; ++b) {
        if (a == b || def.bodies[a].fixed || def.bodies[a].shell < 0 || def.bodies[b].field < 0)
          continue;
        // Two moving bodies that have both touch once, not twice.
        const bool both =
            !def.bodies[b].fixed && def.bodies[b].shell >= 0 && def.bodies[a].field >= 0;
        if (both && b < a) continue;
        pairs.push_back({a, b});
      }
  }
  // Those of one shell body stand together: their contacts are weighed together.
  std::stable_sort(pairs.begin(), pairs.end(), [](const h6PairDef& l, const h6PairDef& r) {
    return l.shell_body < r.shell_body;
  });
  return pairs;
}

// Each point an equal share of the mass; a little is added where points lie on a line or a spot.
Mat3 inertia_of(const Shell& shell, const Vec3& com, double mass, double voxel) {
  Mat3 I = Mat3::Zero();
  for (std::size_t r = 0; r < shell.points; ++r) {
    const Vec3 p = Vec3(shell.x[r], shell.y[r], shell.z[r]) + shell.centre - com;
    I += mass / static_cast<double>(shell.points) *
         (p.squaredNorm() * Mat3::Identity() - p * p.transpose());
  }
  const double least = 0.4 * mass * voxel * voxel;  // a ball of one voxel
  if (Eigen::SelfAdjointEigenSolver<Mat3>(I, Eigen::EigenvaluesOnly).eigenvalues()[0] < least)
    I += least * Mat3::Identity();
  return I;
}

void set_body(h6Session& s, std::size_t i, const h6BodyDef& def,
              const std::vector<h6PairDef>& pairs) {
  Body& body = s.bodies[i];
  body.fixed = def.fixed;
  body.mass = def.mass;
  body.com = from(def.com);
  body.shell = def.shell;
  body.field = def.field;
  double voxel = HUGE_VAL;
  for (const h6PairDef& p : pairs)
    if (p.shell_body == static_cast<std::int32_t>(i) ||
        p.field_body == static_cast<std::int32_t>(i))
      voxel = std::min(voxel, s.model->fields[s.bodies[p.field_body].field].voxel);
  body.voxel = voxel < HUGE_VAL ? voxel : 1e-3;
  if (body.shell >= 0) {
    const Shell& shell = s.model->shells[body.shell];
    for (std::size_t r = 0; r < shell.points; ++r)
      body.radius = std::max(
          body.radius, (Vec3(shell.x[r], shell.y[r], shell.z[r]) + shell.centre - body.com).norm());
  }
  const double* v = def.inertia;
  body.inertia << v[0], v[3], v[4], v[3], v[1], v[5], v[4], v[5], v[2];
  body.translation_only = def.translation_only;
  if (!body.fixed && body.inertia.isZero(0))
    body.inertia = body.shell >= 0  // without a shell it never turns: any will do
                       ? inertia_of(s.model->shells[body.shell], body.com, body.mass, body.voxel)
                       : Mat3(body.mass * body.voxel * body.voxel * Mat3::Identity());
  set_mesh_pose(body, def.pose);
  body.v = from(def.velocity.linear);
  body.w = from(def.velocity.angular);
  if (body.fixed) body.v.setZero(), body.w.setZero();
  if (body.translation_only) body.w.setZero();
}

// Of a free body that a person pushes, where the definition leaves it open (METHOD.md, Sec. 4): a
// grip of 1500 N/m behind 5 ms of delay takes 7.5 N s/m of damping away.
double admittance_damping(const h6HandDef& def, double mass) {
  return def.admittance_damping > 0 ? def.admittance_damping : std::max(mass / 0.02, 10.0);
}

void set_hand(h6Session& s, std::size_t i, const h6HandDef& def) {
  Hand& hand = s.hands[i];
  Body& body = s.bodies[def.body];
  hand.body = def.body;
  hand.mode = def.mode;
  hand.manipulandum_mass = def.manipulandum_mass;
  hand.driver_stiffness = def.driver_stiffness;
  hand.driver_damping = def.driver_damping;
  hand.motion_scale = def.filter.motion_scale;
  hand.rotation_scale = def.filter.rotation_scale;
  // A body that never turns hangs on the origin of its mesh frame.
  const Vec3 com = body.translation_only ? Vec3(Vec3::Zero()) : body.com;
  hand.filter.set(def.filter, com, def.mode != H6_IMPEDANCE);
  hand.safety = def.safety;
  h6DeviceCapabilities unknown{};
  unknown.max_force = SafetyLimits{}.force, unknown.max_torque = SafetyLimits{}.torque;
  unknown.frame_time = true;
  set_rating(hand, unknown);
  hand.passivity = def.passivity;
  hand.port.set(com);
  h6CouplingDef& c = hand.coupling = def.coupling;
  if (c.rotational_stiffness == 0)
    c.rotational_stiffness = c.stiffness * 900 * body.voxel * body.voxel;
  if (c.max_force == 0) c.max_force = s.contact.stiffness * c.max_depth_voxels * body.voxel;
  if (c.max_torque == 0)
    c.max_torque = c.max_force * (body.radius > 0 ? body.radius : 30 * body.voxel);
  if (hand.mode == H6_ADMITTANCE) body.drag += admittance_damping(def, body.mass);
  if (c.mode == H6_COUPLING_STATIC) body.motion = Motion::quasi_static;
  if (c.mode == H6_COUPLING_DIRECT) body.motion = Motion::held;
  body.max_step = c.max_step_voxels * body.voxel;
  if (body.motion != Motion::dynamic) body.v.setZero(), body.w.setZero();
  hand.manipulandum = body;
}

// Moving bodies that pairs connect, in groups of at most four; a larger group falls into single
// bodies, each then treating its neighbours as if they stood still within the step. Bodies without
// mass of their own, quasi-static or held, are nobody's unknowns.
std::vector<Island> islands_of(const h6Session& s, const std::vector<h6PairDef>& pairs) {
  const auto dynamic = [&](std::int32_t i) {
    return !s.bodies[i].fixed && s.bodies[i].motion == Motion::dynamic;
  };
  std::vector<std::int32_t> root(s.body_count);
  for (std::size_t i = 0; i < root.size(); ++i) root[i] = static_cast<std::int32_t>(i);
  const auto find = [&](std::int32_t i) {
    while (root[i] != i) i = root[i];
    return i;
  };
  for (const h6PairDef& p : pairs)
    if (dynamic(p.shell_body) && dynamic(p.field_body))
      root[find(p.field_body)] = find(p.shell_body);
  std::vector<Island> islands;
  for (std::int32_t r = 0; r < static_cast<std::int32_t>(root.size()); ++r) {
    std::vector<std::int32_t> members;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(root.size()); ++i)
      if (dynamic(i) && find(i) == r) members.push_back(i);
    if (members.size() <= kIslandBodies && !members.empty()) {
      Island island{{}, static_cast<int>(members.size())};
      std::copy(members.begin(), members.end(), island.body);
      islands.push_back(island);
    } else {
      for (std::int32_t i : members) islands.push_back({{i}, 1});
    }
  }
  return islands;
}

struct Sizes {
  std::size_t bodies, pairs, hands;
  std::size_t groups, blocks;  // of the largest shell, and (all) of all pairs together
  std::size_t all_groups, all_blocks;
  std::size_t shells = 0;     // bodies that are the shell of a pair
  bool shares = false;        // pairs between two threads
  bool lanes = false;         // shell bodies between two threads
  std::vector<bool> touches;  // (bodies) the body is the shell of a pair
};

// Called twice: with an empty arena to count, then to take.
void lay_out(h6Session& s, Arena& arena, const Sizes& n) {
  s.bodies = arena.take<Body>(n.bodies);
  s.pairs = arena.take<Pair>(n.pairs);
  s.hands = arena.take<Hand>(n.hands);
  s.islands = arena.take<Island>(n.bodies);
  s.contacts = arena.take<Contacts>(n.bodies);
  // Counting has no memory to put headers in.
  for (std::size_t i = 0; i < n.bodies; ++i) {
    Contacts columns{};
    if (n.touches[i]) take_columns(columns, arena, s.max_contacts);
    if (s.contacts) s.contacts[i] = columns;
  }
  s.candidate_capacity = s.max_contacts + kGroupRows * n.groups;
  for (std::size_t i = 0; i < (n.shares || n.lanes ? 2u : 1u); ++i) {
    TraverseScratch& t = s.traversal[i];
    t.frontier = arena.take<std::uint32_t>(n.groups);
    t.survivors = arena.take<std::uint32_t>(n.groups);
    t.far = arena.take<std::uint32_t>(n.groups);
    t.far_survivors = arena.take<std::uint32_t>(n.groups);
    t.open_blocks = arena.take<std::uint32_t>(n.blocks);
    t.clearance = arena.take<float>(n.groups);
    t.rest = arena.take<float>(n.groups);
    t.rows = arena.take<std::uint16_t>(n.groups);
    t.near_rows = arena.take<std::uint16_t>(n.groups);
    t.candidate = arena.take<std::uint32_t>(s.candidate_capacity);
    for (float** column : {&t.candidate_distance, &t.gradient_x, &t.gradient_y, &t.gradient_z})
      *column = arena.take<float>(s.candidate_capacity);
  }
  s.group_expiry = arena.take<float>(n.all_groups);
  s.block_expiry = arena.take<float>(n.all_blocks);
  s.rest_expiry = arena.take<float>(n.all_groups);
  s.near_rows = arena.take<std::uint16_t>(n.all_groups);
  const std::size_t merged = uses_clusters(s.contact) ? s.max_contacts : 0;
  s.cluster_order = arena.take<std::uint32_t>(merged);
  s.cluster_root = arena.take<std::uint32_t>(merged);
  s.cluster_cell = arena.take<std::uint64_t>(merged);
  const std::size_t weighing = weigh_scratch_bytes(s.contact, s.max_contacts);
  s.weigh_scratch = weighing ? arena.take<char>(weighing) : nullptr;
  s.slice_count = arena.take<std::size_t>(n.groups / kTouchSlice + 1);
  s.slice_sum = arena.take<kernels::WrenchSum>(s.max_contacts / kSumSlice + 1);
  s.shell_pairs = arena.take<std::uint32_t>(n.shells + 1);
  if (!n.lanes) return;
  s.lanes = arena.take<h6Session>(2);
  s.lane_scratch = {arena.take<std::uint32_t>(merged), arena.take<std::uint32_t>(merged),
                    arena.take<std::uint64_t>(merged),
                    weighing ? arena.take<char>(weighing) : nullptr};
}

bool fill(h6Session& s, const h6SessionDef& def, h6Error* error) {
  const std::vector<h6PairDef> pairs = pairs_of(def);
  Sizes n{def.body_count,
          pairs.size(),
          def.hand_count,
          16,
          16,
          0,
          0,
          0,
          false,
          false,
          std::vector<bool>(def.body_count)};
  for (const h6PairDef& p : pairs) {
    const Shell& shell = s.model->shells[def.bodies[p.shell_body].shell];
    n.groups = std::max(n.groups, 16 * shell.blocks.count);
    n.blocks = std::max(n.blocks, shell.blocks.x.count);
    n.all_groups += 16 * shell.blocks.count;
    n.all_blocks += shell.blocks.x.count;
    n.shares = n.shares || (def.threads > 1 && n.touches[p.shell_body]);
    n.shells += !n.touches[p.shell_body];
    n.touches[p.shell_body] = true;
  }
  n.lanes = def.threads > 1 && n.shells > 1;
  Arena count;
  lay_out(s, count, n);
  s.memory_bytes = count.used();
  s.memory = allocate(def.allocator, s.memory_bytes);
  if (!s.memory)
    return fail(error, "no memory for the session (%zu MB): lower max_contacts",
                s.memory_bytes / 1000000);
  // Pages are touched now, not in the first frames.
  std::fill_n(static_cast<char*>(s.memory), s.memory_bytes, char{0});
  Arena arena(s.memory, s.memory_bytes);
  lay_out(s, arena, n);

  s.body_count = n.bodies;
  for (std::size_t i = 0; i < n.bodies; ++i) {
    new (&s.bodies[i]) Body();
    s.bodies[i].field = def.bodies[i].field;  // voxels of pairs are read before every body is set
  }
  for (std::size_t i = 0; i < n.bodies; ++i) set_body(s, i, def.bodies[i], pairs);
  s.pair_count = n.pairs;
  float *group_expiry = s.group_expiry, *block_expiry = s.block_expiry;
  for (std::size_t i = 0; i < n.pairs; ++i) {
    new (&s.pairs[i]) Pair();
    s.pairs[i].a = pairs[i].shell_body;
    s.pairs[i].b = pairs[i].field_body;
    s.pairs[i].group_expiry = group_expiry;
    s.pairs[i].block_expiry = block_expiry;
    s.pairs[i].rest_expiry = s.rest_expiry + (group_expiry - s.group_expiry);
    s.pairs[i].near_rows = s.near_rows + (group_expiry - s.group_expiry);
    const Shell& shell = s.model->shells[s.bodies[s.pairs[i].a].shell];
    group_expiry += 16 * shell.blocks.count;
    block_expiry += shell.blocks.x.count;
    if (i == 0 || pairs[i - 1].shell_body != pairs[i].shell_body)
      s.shell_pairs[s.shell_count++] = static_cast<std::uint32_t>(i);
  }
  s.shell_pairs[s.shell_count] = static_cast<std::uint32_t>(n.pairs);
  s.hand_count = n.hands;
  for (std::size_t i = 0; i < n.hands; ++i) {
    new (&s.hands[i]) Hand();
    set_hand(s, i, def.hands[i]);
  }
  const std::vector<Island> islands = islands_of(s, pairs);
  s.island_count = islands.size();
  std::copy(islands.begin(), islands.end(), s.islands);
  s.team = new sched::FrameTeam(def.threads);
  if (n.lanes) s.alone = new sched::FrameTeam(1);
  open_lanes(s);
  return true;
}

}  // namespace
}  // namespace h6

using namespace h6;

extern "C" {

h6Session* h6CreateSession(const h6Model* model, const h6SessionDef* def, h6Error* error) {
  if (!model || !def) return fail(error, "a session needs a model and a definition"), nullptr;
  if (!check_session(*model, *def, error)) return nullptr;
  h6Session* s = create<h6Session>(def->allocator);
  if (!s) return fail(error, "no memory for a session"), nullptr;
  s->model = model;
  s->allocator = def->allocator;
  s->contact = def->contact;
  s->integrator = def->integrator;
  s->gradient = def->gradient;
  s->dt = 1 / def->rate;
  s->gravity = from(def->gravity);
  s->net_stiffness = def->net_stiffness;
  s->max_contacts = def->max_contacts;
  s->anytime.budget_ns = 1e3 * def->frame_budget_us;
  bool ready = false;
  try {
    ready = fill(*s, *def, error);
  } catch (const std::exception& e) {  // threads, small tables
    fail(error, "the session could not be made: %s", e.what());
  }
  s->tick_length.see(sched::now_ns(), sched::ticks());
  if (ready) return s;
  h6DestroySession(s);
  return nullptr;
}

void h6DestroySession(h6Session* s) {
  if (!s) return;
  delete s->team;
  delete s->alone;
  release(s->allocator, s->memory, s->memory_bytes);
  const h6Allocator allocator = s->allocator;
  destroy(allocator, s);
}

}  // extern "C"
