// SPDX-License-Identifier: Apache-2.0
// session.cpp - makes a session from its definition: derives all values and reserves all memory, so
// that a frame need not.
#include "runtime/frame/session.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <new>
#include <vector>

#include "runtime/contact/contact_stages.h"
#include "runtime/contact/traverse_pair.h"
#include "runtime/contact/weighing.h"
#include "runtime/frame/session_checks.h"

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
        // Two moving bodies that both have a shell and a field make one pair, not two.
        const bool both =
            !def.bodies[b].fixed && def.bodies[b].shell >= 0 && def.bodies[a].field >= 0;
        if (both && b < a) continue;
        pairs.push_back({a, b});
      }
  }
  // Pairs of one shell body must be neighbours, because their contacts are weighed together.
  std::stable_sort(pairs.begin(), pairs.end(), [](const h6PairDef& l, const h6PairDef& r) {
    return l.shell_body < r.shell_body;
  });
  return pairs;
}

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

// The smallest voxel of the fields that body i can touch, and of its own field if others touch it
// [m].
double voxel_of(const h6Model& model, const h6SessionDef& def, std::int32_t i,
                std::span<const h6PairDef> pairs) {
  double voxel = HUGE_VAL;
  for (const h6PairDef& p : pairs)
    if (p.shell_body == i || p.field_body == i)
      voxel = std::min(voxel, model.fields[def.bodies[p.field_body].field].finest);
  return voxel < HUGE_VAL ? voxel : 1e-3;
}

// A default contact carries this many times the weight at a depth of one voxel, and has at least
// this natural frequency under any mass [rad/s] (METHOD.md, Sec. 4).
constexpr double kWeights = 4, kContactFrequency = 100;

// The default stiffness, and the part of it that sets the coupling's force: a heavy part wants a
// stiff wall, but no strong hand.
struct Stiffness {
  double contact, force;
};
Stiffness stiffness_for(const h6Model& model, const h6SessionDef& def,
                        std::span<const h6PairDef> pairs) {
  if (def.contact.stiffness > 0) return {def.contact.stiffness, def.contact.stiffness};
  Stiffness k{kLeastStiffness, kLeastStiffness};
  for (const h6PairDef& p : pairs)
    for (const std::int32_t i : {p.shell_body, p.field_body}) {
      if (def.bodies[i].fixed) continue;
      const double mass = def.bodies[i].mass, voxel = voxel_of(model, def, i, pairs);
      k.force = std::max(k.force, kWeights * mass * from(def.gravity).norm() / voxel);
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
std::vector<Island> islands_of(std::span<const Body> bodies, std::span<const h6PairDef> pairs) {
  const auto dynamic = [&](std::int32_t i) {
    return !bodies[i].fixed && bodies[i].motion == Motion::dynamic;
  };
  std::vector<std::int32_t> root(bodies.size());
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
  std::size_t bodies = 0, pairs = 0, hands = 0;
  std::size_t shells = 0;                      // bodies that are the shell of a pair
  std::size_t groups = 16, blocks = 16;        // for the largest shell
  std::size_t all_groups = 0, all_blocks = 0;  // for all pairs together
  std::size_t between = 0, of_fields = 0;      // pairs with these columns
  bool shares = false;                         // two threads share the pairs of a shell body
  bool lanes = false;                          // two threads share the shell bodies
};

bool both_move(const h6SessionDef& def, const h6PairDef& p) {
  return !def.bodies[p.shell_body].fixed && !def.bodies[p.field_body].fixed;
}
bool couples_fields(const h6SessionDef& def, const h6PairDef& p) {
  return uses_series(def.contact) && !def.bodies[p.field_body].fixed;
}

Sizes sizes_of(const h6Model& model, const h6SessionDef& def, std::span<const h6PairDef> pairs) {
  Sizes n;
  n.bodies = def.body_count, n.pairs = pairs.size(), n.hands = def.hand_count;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Shell& shell = model.shells[def.bodies[pairs[i].shell_body].shell];
    n.groups = std::max(n.groups, 16 * shell.blocks.count);
    n.blocks = std::max(n.blocks, shell.blocks.x.count);
    n.all_groups += 16 * shell.blocks.count;
    n.all_blocks += shell.blocks.x.count;
    n.between += both_move(def, pairs[i]);
    n.of_fields += couples_fields(def, pairs[i]);
    const bool another = i > 0 && pairs[i - 1].shell_body == pairs[i].shell_body;
    n.shells += !another;
    n.shares = n.shares || (def.threads > 1 && another);
  }
  n.lanes = def.threads > 1 && n.shells > 1;
  return n;
}

// The columns that pairs point into.
struct PairColumns {
  PairSearch* searches;
  kernels::WrenchSum* sums;
  BetweenBodies* between;
  BetweenFields* of_fields;
  float *group_expiry, *block_expiry, *rest_expiry;
  std::uint16_t* near_rows;
};

template <class T>
std::span<T> take(Arena& arena, std::size_t n) {
  return {arena.take<T>(n), n};
}

void take_traversal(TraverseScratch& t, Arena& arena, const Sizes& n, std::size_t max_contacts) {
  t.capacity = max_contacts + kGroupRows * n.groups;
  t.frontier = arena.take<std::uint32_t>(n.groups);
  t.survivors = arena.take<std::uint32_t>(n.groups);
  t.far = arena.take<std::uint32_t>(n.groups);
  t.far_survivors = arena.take<std::uint32_t>(n.groups);
  t.open_blocks = arena.take<std::uint32_t>(n.blocks);
  t.clearance = arena.take<float>(n.groups);
  t.rest = arena.take<float>(n.groups);
  t.reach = arena.take<float>(n.groups);
  t.rows = arena.take<std::uint16_t>(n.groups);
  t.near_rows = arena.take<std::uint16_t>(n.groups);
  t.candidate = arena.take<std::uint32_t>(t.capacity);
  for (float** column :
       {&t.candidate_distance, &t.key, &t.gradient_x, &t.gradient_y, &t.gradient_z})
    *column = arena.take<float>(t.capacity);
}

void take_scratch(Scratch& scratch, Arena& arena, const Sizes& n, const Settings& set) {
  const std::size_t merged = uses_clusters(set.contact) ? set.max_contacts : 0;
  scratch.cluster = {arena.take<std::uint32_t>(merged), arena.take<std::uint32_t>(merged),
                     arena.take<std::uint64_t>(merged)};
  const std::size_t weighing = weigh_scratch_bytes(set.contact, set.max_contacts);
  scratch.weigh = weighing ? arena.take<char>(weighing) : nullptr;
  scratch.slice_count = arena.take<std::size_t>(n.groups / kTouchSlice + 1);
  scratch.slice_sum = arena.take<kernels::WrenchSum>(set.max_contacts / kSumSlice + 1);
  const std::size_t rubbing = set.contact.friction > 0 ? set.max_contacts : 0;
  scratch.friction = {arena.take<double>(rubbing), arena.take<double>(rubbing)};
}

// Called twice: with an empty arena to count bytes, then with memory to take it.
void lay_out(h6Session& s, PairColumns& columns, Arena& arena, const Sizes& n) {
  s.bodies = take<Body>(arena, n.bodies);
  s.acting = take<LinearWrench>(arena, n.bodies);
  s.pairs = take<Pair>(arena, n.pairs);
  s.shells = take<ShellBody>(arena, n.shells);
  s.hands = take<Hand>(arena, n.hands);
  s.devices = take<HandDevice>(arena, n.hands);
  s.islands = take<Island>(arena, n.bodies);
  s.frictions = take<FrictionSpring>(arena, s.settings.contact.friction > 0 ? n.pairs : 0);
  columns = {arena.take<PairSearch>(n.pairs),      arena.take<kernels::WrenchSum>(n.pairs),
             arena.take<BetweenBodies>(n.between), arena.take<BetweenFields>(n.of_fields),
             arena.take<float>(n.all_groups),      arena.take<float>(n.all_blocks),
             arena.take<float>(n.all_groups),      arena.take<std::uint16_t>(n.all_groups)};
  for (std::size_t i = 0; i < n.shells; ++i) {
    Contacts contacts{};
    take_columns(contacts, arena, s.settings.max_contacts);
    if (s.settings.contact.method != H6_METHOD_FIRM) contacts.cell = nullptr;
    // While counting there is no memory for the objects.
    if (s.shells.data()) (new (&s.shells[i]) ShellBody{})->contacts = contacts;
  }
  for (int i = 0; i < (n.shares || n.lanes ? 2 : 1); ++i)
    take_traversal(s.lanes.scratch[i].traverse, arena, n, s.settings.max_contacts);
  for (int i = 0; i < (n.lanes ? 2 : 1); ++i)
    take_scratch(s.lanes.scratch[i], arena, n, s.settings);
}

// Sets all pairs and shell bodies. All columns must be laid out.
void set_pairs(h6Session& s, const h6SessionDef& def, std::span<const h6PairDef> pairs,
               PairColumns to) {
  PairSearch* const searches = to.searches;
  kernels::WrenchSum* const sums = to.sums;
  ShellBody* shell = nullptr;
  std::size_t shells = 0, first = 0;  // `first`: the first pair of the shell body
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    Pair& pair = *new (&s.pairs[i]) Pair();
    PairSearch& search = *new (&searches[i]) PairSearch();
    new (&sums[i]) kernels::WrenchSum();
    if (!s.frictions.empty()) new (&s.frictions[i]) FrictionSpring();
    pair.a = pairs[i].shell_body;
    pair.b = pairs[i].field_body;
    if (both_move(def, pairs[i])) pair.between = new (to.between++) BetweenBodies();
    if (couples_fields(def, pairs[i])) pair.of_fields = new (to.of_fields++) BetweenFields();
    search.group_expiry = to.group_expiry;
    search.block_expiry = to.block_expiry;
    search.rest_expiry = to.rest_expiry;
    search.near_rows = to.near_rows;
    const Tier& blocks = s.bodies[pair.a].shell->blocks;
    to.group_expiry += 16 * blocks.count;
    to.block_expiry += blocks.x.count;
    to.rest_expiry += 16 * blocks.count;
    to.near_rows += 16 * blocks.count;
    if (i == 0 || pairs[i - 1].shell_body != pairs[i].shell_body) {
      shell = &s.shells[shells++];
      shell->body = pair.a;
      first = i;
    }
    const std::size_t count = i + 1 - first;
    shell->pairs = s.pairs.subspan(first, count);
    shell->searches = {searches + first, count};
    shell->sums = {sums + first, count};
    if (!s.frictions.empty()) shell->frictions = s.frictions.subspan(first, count);
  }
  s.anytime.pairs = {searches, pairs.size()};
}

bool fill(h6Session& s, const h6SessionDef& def, h6Error* error) {
  const std::vector<h6PairDef> pairs = pairs_of(def);
  const Sizes n = sizes_of(*s.model, def, pairs);
  PairColumns columns;
  Arena count;
  lay_out(s, columns, count, n);
  s.memory_bytes = count.used();
  s.memory = allocate(def.allocator, s.memory_bytes);
  if (!s.memory)
    return fail(error, "no memory for the session (%zu MB): lower max_contacts",
                s.memory_bytes / 1000000);
  // This touches all pages now, so that the first frames have no page faults.
  std::fill_n(static_cast<char*>(s.memory), s.memory_bytes, char{0});
  Arena arena(s.memory, s.memory_bytes);
  lay_out(s, columns, arena, n);

  for (std::size_t i = 0; i < n.bodies; ++i) {
    Body& body = *new (&s.bodies[i]) Body();
    if (const std::int32_t shell = def.bodies[i].shell; shell >= 0)
      body.shell = &s.model->shells[shell];
    if (const std::int32_t field = def.bodies[i].field; field >= 0)
      body.field = &s.model->fields[field];
  }
  for (std::size_t i = 0; i < n.bodies; ++i)
    set_body(s.bodies[i], def.bodies[i],
             voxel_of(*s.model, def, static_cast<std::int32_t>(i), pairs));
  const Stiffness k = stiffness_for(*s.model, def, pairs);
  s.settings.contact.stiffness = k.contact;
  set_pairs(s, def, pairs, columns);
  for (std::size_t i = 0; i < n.hands; ++i)
    set_hand(s.settings, k.force, *new (&s.hands[i]) Hand(), *new (&s.devices[i]) HandDevice(),
             s.bodies[def.hands[i].body], def.hands[i]);
  const std::vector<Island> islands = islands_of(s.bodies, pairs);
  s.islands = s.islands.first(islands.size());
  std::copy(islands.begin(), islands.end(), s.islands.begin());
  s.team = new sched::FrameTeam(def.threads);
  if (n.lanes) s.alone = new sched::FrameTeam(1);
  open_lanes(s.lanes, s.team, s.alone, &s.anytime);
  return measure_overlap(s, error);
}

}  // namespace
}  // namespace h6

using namespace h6;

extern "C" {

double h6StiffnessFor(const h6Model* model, const h6SessionDef* def) {
  h6Error error;
  if (!model || !def || !check_session(*model, *def, &error)) return 0;
  try {
    return stiffness_for(*model, *def, pairs_of(*def)).contact;
  } catch (const std::exception&) {  // no memory for the pairs
    return 0;
  }
}

h6Session* h6CreateSession(const h6Model* model, const h6SessionDef* def, h6Error* error) {
  if (!model || !def) return fail(error, "a session needs a model and a definition"), nullptr;
  if (!check_session(*model, *def, error)) return nullptr;
  h6Session* s = create<h6Session>(def->allocator);
  if (!s) return fail(error, "no memory for a session"), nullptr;
  s->model = model;
  s->allocator = def->allocator;
  s->settings = {
      .contact = def->contact,
      .integrator = def->integrator,
      .gradient = def->gradient,
      .dt = 1 / def->rate,
      .gravity = from(def->gravity),
      .net_stiffness = def->net_stiffness,
      .max_contacts = def->max_contacts,
      // Explicit steps are for comparison; the damper of an impact is too stiff for them.
      .max_substeps = def->integrator == H6_EXPLICIT ? 1 : def->max_substeps};
  s->anytime.budget_ns = 1e3 * def->frame_budget_us;
  s->anytime.period_ns = 1e9 * s->settings.dt;
  bool ready = false;
  try {
    ready = fill(*s, *def, error);
  } catch (const std::exception& e) {  // from threads and small tables
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
  forget_overlap(*s);
  release(s->allocator, s->memory, s->memory_bytes);
  const h6Allocator allocator = s->allocator;
  destroy(allocator, s);
}

}  // extern "C"
