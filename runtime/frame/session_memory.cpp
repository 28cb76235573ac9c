// SPDX-License-Identifier: Apache-2.0
// session_memory.cpp - counts what a session needs, reserves it in one piece and lays it out.
#include "runtime/frame/session_memory.h"

#include <algorithm>
#include <new>

#include "runtime/contact/weighing.h"
#include "runtime/frame/scratch_memory.h"
#include "runtime/frame/session.h"
#include "runtime/frame/workers.h"
#include "sched/host_memory.h"

namespace h6 {
namespace {

// So many pairs of a shell body remember their searches; others that are near begin anew in every
// step.
constexpr std::size_t kRemembered = 64;
// A point is given room for contacts with so many fields at a time.
constexpr std::size_t kFieldsAtAPoint = 8;

// Room for pairs that are near at a time, where the definition leaves it open.
std::size_t default_pairs(std::size_t shells) { return 4096 + 16 * shells; }

// A body whose shell may touch fields.
struct ShellSize {
  std::int32_t body;
  std::size_t fields;    // that it may touch
  std::size_t contacts;  // room
};

struct Sizes {
  std::size_t bodies = 0, hands = 0, listed = 0;
  std::size_t pairs = 0;  // near at a time
  ScratchRoom scratch;
  sched::HostVector<ShellSize> shells;
  sched::HostVector<std::int32_t> bends;  // bodies whose shells bend
  bool between = false;                   // the bodies of a pair may both move
  bool of_fields = false;                 // `series` couples fields that move
  std::size_t traversals = 1, lanes = 0;  // one for each thread that may need one; of workers: 0
};

Sizes sizes_of(const h6Model& model, const Settings& set, const h6SessionDef& def,
               std::span<const h6PairDef> listed) {
  Sizes n;
  std::size_t groups = 0, blocks = 0;
  n.bodies = def.body_count, n.hands = def.hand_count, n.listed = listed.size();
  std::size_t all = 0;
  each_pair(model, def, listed, [&](std::int32_t a, std::int32_t b) {
    const bool moves = !def.bodies[b].fixed;
    n.between = n.between || (moves && !def.bodies[a].fixed);
    n.of_fields = n.of_fields || (moves && uses_series(def.contact));
    if (n.shells.empty() || n.shells.back().body != a) n.shells.push_back({a, 0, 0});
    ++n.shells.back().fields;
    ++all;
  });
  for (std::size_t i = 0; i < def.body_count; ++i)
    if (const std::int32_t shell = def.bodies[i].shell; shell >= 0 && model.shells[shell].bends())
      n.bends.push_back(static_cast<std::int32_t>(i));
  bool shares = n.shells.size() > 1;
  for (ShellSize& size : n.shells) {
    const Shell& shell = model.shells[def.bodies[size.body].shell];
    groups = std::max(groups, 16 * shell.blocks.count);
    blocks = std::max(blocks, shell.blocks.x.count);
    size.contacts =
        std::min(def.max_contacts, shell.points * std::min(size.fields, kFieldsAtAPoint));
    shares = shares || size.fields > 1;
  }
  n.scratch = scratch_room(set, groups, blocks);
  n.scratch.slices = def.threads > 1 && !def.workers;
  n.pairs = std::min(all, def.max_pairs ? def.max_pairs : default_pairs(n.shells.size()));
  if (shares) n.traversals = def.threads;
  if (n.shells.size() > 1 && def.threads > 1) n.lanes = def.threads;
  if (def.workers) n.traversals = 0;
  return n;
}

// Takes `n` objects. While the arena only counts, there is no memory for them.
template <class T>
std::span<T> take(Arena& arena, std::size_t n) {
  T* const first = arena.take<T>(n);
  for (std::size_t i = 0; first && i < n; ++i) new (first + i) T{};
  return {first, n};
}

void lay_out_shell(const Settings& set, const ShellSize& size, const Shell& points,
                   std::size_t pairs, ShellBody* shell, Arena& arena) {
  Contacts contacts{};
  take_columns(contacts, arena, size.contacts);
  if (set.contact.method != H6_METHOD_FIRM) contacts.cell = nullptr;
  const std::size_t kept = std::min({size.fields, kRemembered, pairs});
  const std::span<SearchColumns> unused = take<SearchColumns>(arena, kept);
  for (std::size_t i = 0; i < kept; ++i) {
    const SearchColumns columns =
        take_search(arena, 16 * points.blocks.count, points.blocks.x.count);
    if (shell) unused[i] = columns;
  }
  if (!shell) return;  // the arena only counts
  shell->body = size.body;
  shell->contacts = contacts;
  shell->unused = unused;
  shell->unused_count = kept;
}

void lay_out_near(NearPairs& near, const Sizes& n, Arena& arena) {
  near.listed = take<NearPairs::Listed>(arena, n.listed);
  near.listed_field = take<std::int32_t>(arena, n.listed);
  near.pairs = take<Pair>(arena, n.pairs);
  near.unused = take<std::uint32_t>(arena, n.pairs);
  near.near = take<NearPairs::Near>(arena, n.pairs);
  near.spare = take<NearPairs::Near>(arena, n.pairs);
  near.found = take<std::uint64_t>(arena, NearPairs::kFound * n.pairs);
  near.awake = take<Pair*>(arena, n.pairs);
  near.active = take<ShellBody*>(arena, n.shells.size());
  near.places = take<BodyPlace>(arena, n.bodies);
  near.lively = take<std::uint32_t>(arena, n.bodies);
  near.boxes.lay_out(arena, n.bodies);
}

// Of a shell that bends: columns as in the shell, rows for as many contacts as it may have.
void lay_out_bend(const Settings& set, const Shell& shell, Deformation* to, Arena& arena) {
  Deformation counted, &d = to ? *to : counted;
  for (Tier* tier : {&d.blocks, &d.groups}) {
    const Tier& rest = tier == &d.blocks ? shell.blocks : shell.groups;
    tier->count = rest.count;
    for (Column<float>* column : {&tier->x, &tier->y, &tier->z, &tier->radius})
      column->take(arena, rest.x.count);
  }
  for (Column<float>* column : {&d.x, &d.y, &d.z, &d.nx, &d.ny, &d.nz})
    column->take(arena, shell.x.count);
  for (Column<float>* column : {&d.ux, &d.uy, &d.uz, &d.wx, &d.wy, &d.wz})
    column->take(arena, shell.bend.warps ? shell.x.count : 0);
  const std::size_t r = shell.bend.modes, contacts = set.max_contacts;
  const bool exact = set.gradient == H6_EXACT;
  d.shell = &shell;
  d.modes = static_cast<int>(r);
  d.sums.size = 6 + r;
  d.sums.stride = (6 + r + 7) / 8 * 8;
  d.row = arena.take<std::uint32_t>(contacts);
  d.load = arena.take<float>(contacts);
  d.share = arena.take<float>(contacts);
  d.push = arena.take<float>(contacts * d.sums.stride);
  d.slope = arena.take<float>(exact ? contacts * d.sums.stride : 0);
  d.sums.force = arena.take<double>(d.sums.stride);
  d.sums.stiffness = arena.take<double>(d.sums.size * d.sums.stride);
  d.sums.damping = arena.take<double>(d.sums.size * d.sums.stride);
  d.internal = arena.take<double>((r + 7) / 8 * 8);
  d.tangent = arena.take<double>(r * ((r + 7) / 8 * 8));
}

// Called twice: with an arena that only counts, then with one over the memory.
void lay_out(h6Session& s, const h6SessionDef& def, const Sizes& n, Arena& arena) {
  s.bodies = take<Body>(arena, n.bodies);
  s.acting = take<LinearWrench>(arena, n.bodies);
  s.hands = take<Hand>(arena, n.hands);
  s.devices = take<HandDevice>(arena, n.hands);
  s.islands = take<Island>(arena, n.bodies);
  lay_out_near(s.near, n, arena);
  s.between = take<BetweenBodies>(arena, n.between ? n.pairs : 0);
  s.of_fields = take<BetweenFields>(arena, n.of_fields ? n.pairs : 0);
  s.frictions = take<FrictionSpring>(arena, contacts_rub(def.contact) ? n.pairs : 0);
  s.shells = take<ShellBody>(arena, n.shells.size());
  for (std::size_t i = 0; i < n.shells.size(); ++i) {
    const Shell& points = s.model->shells[def.bodies[n.shells[i].body].shell];
    lay_out_shell(s.settings, n.shells[i], points, n.pairs,
                  s.shells.data() ? &s.shells[i] : nullptr, arena);
  }
  s.bends = take<Deformation>(arena, n.bends.size());
  for (std::size_t i = 0; i < n.bends.size(); ++i) {
    const Shell& shell = s.model->shells[def.bodies[n.bends[i]].shell];
    lay_out_bend(s.settings, shell, s.bends.data() ? &s.bends[i] : nullptr, arena);
    if (s.bends.data()) s.bends[i].body = n.bends[i];
  }
  s.lanes.scratch = take<Scratch>(arena, n.traversals);
  s.lanes.single = take<Lane>(arena, n.lanes);
  for (std::size_t i = 0; i < n.traversals; ++i) {
    Scratch counted;
    Scratch& scratch = s.lanes.scratch.data() ? s.lanes.scratch[i] : counted;
    lay_out_scratch(scratch, arena, n.scratch, i == 0 || n.lanes > 0);
  }
}

void list_pairs(std::span<const h6PairDef> listed, NearPairs& near) {
  for (std::size_t i = 0; i < listed.size(); ++i) {
    near.listed[i] = {listed[i].shell_body, listed[i].field_body, static_cast<std::uint32_t>(i)};
    near.listed_field[i] = listed[i].field_body;
  }
  std::sort(near.listed.begin(), near.listed.end(),
            [](const NearPairs::Listed& l, const NearPairs::Listed& r) {
              return l.a != r.a ? l.a < r.a : l.b < r.b;
            });
}

bool in_slabs(const h6Session& s) { return s.workers && !s.allocator.allocate; }

}  // namespace

bool reserve_memory(h6Session& s, const h6SessionDef& def, std::span<const h6PairDef> listed,
                    h6Error* error) {
  const Sizes n = sizes_of(*s.model, s.settings, def, listed);
  if (def.workers && !make_room(*def.workers, n.scratch, error)) return false;
  Arena count;
  lay_out(s, def, n, count);
  s.memory_bytes = count.used();
  s.memory =
      in_slabs(s) ? s.workers->slabs.take(s.memory_bytes) : allocate(s.allocator, s.memory_bytes);
  if (!s.memory)
    return fail(error, H6_ERROR_MEMORY,
                "no memory for the session (%zu MB): lower max_contacts or max_pairs",
                s.memory_bytes / 1000000);
  // This touches all pages now, so that the first frames have no page faults.
  std::fill_n(static_cast<char*>(s.memory), s.memory_bytes, char{0});
  Arena arena(s.memory, s.memory_bytes);
  lay_out(s, def, n, arena);
  if (def.workers) s.lanes.scratch = std::span(def.workers->scratch).first(1);
  list_pairs(listed, s.near);
  for (std::size_t i = 0; i < n.pairs; ++i)  // the first row is taken first
    s.near.unused[i] = static_cast<std::uint32_t>(n.pairs - 1 - i);
  s.near.unused_count = n.pairs;
  for (std::size_t i = 0; i < n.bodies; ++i) {
    if (const std::int32_t shell = def.bodies[i].shell; shell >= 0)
      s.bodies[i].shell = &s.model->shells[shell];
    if (const std::int32_t field = def.bodies[i].field; field >= 0)
      s.bodies[i].field = &s.model->fields[field];
  }
  for (std::size_t i = 0; i < n.shells.size(); ++i)
    s.bodies[n.shells[i].body].meets = static_cast<std::int32_t>(i);
  for (Deformation& d : s.bends) s.bodies[d.body].bend = &d;
  return true;
}

void release_memory(h6Session& s) {
  if (!s.memory) return;
  if (in_slabs(s))
    s.workers->slabs.give_back(s.memory, s.memory_bytes);
  else
    release(s.allocator, s.memory, s.memory_bytes);
}

}  // namespace h6
