// SPDX-License-Identifier: Apache-2.0
// near_pairs.cpp - follows the boxes of bodies and keeps the list of near pairs.
#include "runtime/frame/near_pairs.h"

#include <algorithm>
#include <new>

#include "runtime/contact/contact_stages.h"
#include "runtime/frame/session.h"

namespace h6 {
namespace {

using Near = NearPairs::Near;
using Listed = NearPairs::Listed;

// A box's slack: this part of the body's size, and so many steps as long as the coming one. A body
// that never moves needs none.
constexpr double kSlackOfSize = 0.05, kSlackSteps = 8;
// Rounding never places a point of a field's region farther outside of its box [voxel].
constexpr double kRounding = 0.02;

std::uint64_t key_of(std::int32_t a, std::uint32_t second) {
  return std::uint64_t(std::uint32_t(a)) << 32 | second;
}
std::int32_t shell_of(std::uint64_t key) { return static_cast<std::int32_t>(key >> 32); }
std::int32_t field_of(const NearPairs& n, std::uint64_t key) {
  const auto second = static_cast<std::uint32_t>(key);
  return n.listed.empty() ? static_cast<std::int32_t>(second) : n.listed_field[second];
}

// False: the two never touch.
bool find_key(const h6Session& s, std::int32_t a, std::int32_t b, std::uint64_t& key) {
  const NearPairs& n = s.near;
  if (n.listed.empty()) {
    const Body &shell = s.bodies[a], &field = s.bodies[b];
    key = key_of(a, static_cast<std::uint32_t>(b));
    if (a == b || (shell.fixed && !shell.bend) || !shell.shell || !field.field) return false;
    return !(b < a && !field.fixed && field.shell && shell.field);
  }
  const auto at =
      std::lower_bound(n.listed.begin(), n.listed.end(), std::pair(a, b),
                       [](const Listed& l, const auto& p) { return std::pair(l.a, l.b) < p; });
  if (at == n.listed.end() || at->a != a || at->b != b) return false;
  key = key_of(a, at->rank);
  return true;
}

// ---- places and boxes
// ----------------------------------------------------------------------------

// The box around all places where a point can take part [m].
Box region_of(const Settings& set, const Field& field) {
  const double margin = uses_series(set.contact) ? set.contact.margin_voxels : 0.0;
  return grown(field.box, field.voxel * (margin + kRounding));
}

void place_body(const Settings& set, const Body& body, BodyPlace& place) {
  place.x = body.x, place.q = body.q;
  const Vec3 shift = body.x - body.R * body.com;
  if (body.shell)
    place.shell =
        placed(body.bend ? grown(body.shell->box, double{body.bend->reach}) : body.shell->box,
               body.R, shift);
  if (body.field) place.field = placed(region_of(set, *body.field), body.R, shift);
}

bool has_moved(const Body& body, const BodyPlace& place) {
  return body.x != place.x || body.q.coeffs() != place.q.coeffs();
}

void follow_body(h6Session& s, std::size_t i) {
  Body& body = s.bodies[i];
  BodyPlace& place = s.near.places[i];
  if (has_moved(body, place)) {
    const auto &q = body.q.coeffs(), &before = place.q.coeffs();
    body.travelled.shift += (body.x - place.x).norm();
    // A point at distance r moves by 2 r sin(angle / 2), at most 2 r times this chord.
    body.travelled.turn += 2 * std::min((q - before).norm(), (q + before).norm());
    place_body(s.settings, body, place);
  } else if (body.bend) {
    place_body(s.settings, body, place);
  }
  const Box both = grown(united(place.shell, place.field), place.reach);
  place.left = !holds(s.near.boxes.of(i), both);
  if (place.left)
    s.near.boxes.set(i, grown(both, kSlackOfSize * place.radius + kSlackSteps * place.reach));
}

// ---- rows of pairs
// -------------------------------------------------------------------------------

// The pair has no contacts in this step. `far`: all of its points are free.
void put_to_sleep(Pair& pair, bool far) {
  if (far) pair.search.fit.count = 0;
  if (!pair.awake) return;
  pair.awake = false;
  pair.begin = pair.end = 0;
  pair.search.candidates = pair.search.sampled = 0;
  pair.search.open_blocks = pair.search.open_groups = 0;
  pair.search.missed = pair.search.fit.deepest = 0;
  if (pair.friction) *pair.friction = {};
  clear_wrench(pair);
}

bool moves(const Body& body) { return !body.fixed; }

// Gives a row to the pair. False: there is none left.
bool add_row(h6Session& s, Near& near) {
  NearPairs& n = s.near;
  if (n.unused_count == 0) return false;
  const std::uint32_t slot = near.slot = n.unused[--n.unused_count];
  Pair& pair = n.pairs[slot];
  std::destroy_at(&pair);
  std::construct_at(&pair);
  pair.a = shell_of(near.key), pair.b = field_of(n, near.key);
  const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
  if (moves(a) && moves(b)) pair.between = &s.between[slot];
  if (uses_series(s.settings.contact) && moves(b)) pair.of_fields = &s.of_fields[slot];
  // A body that bends has no friction: METHOD.md, Sec. 10.
  if (!s.frictions.empty() && !a.bend) pair.friction = &s.frictions[slot];
  if (pair.between) *pair.between = {};
  if (pair.of_fields) *pair.of_fields = {};
  if (pair.friction) *pair.friction = {};
  ShellBody& shell = s.shells[a.meets];
  if (shell.unused_count > 0)
    static_cast<SearchColumns&>(pair.search) = shell.unused[--shell.unused_count];
  return true;
}

void remove_row(h6Session& s, const Near& near) {
  NearPairs& n = s.near;
  const Pair& pair = n.pairs[near.slot];
  if (pair.friction) *pair.friction = {};
  ShellBody& shell = s.shells[s.bodies[pair.a].meets];
  if (pair.search.group_expiry) shell.unused[shell.unused_count++] = pair.search;
  n.unused[n.unused_count++] = near.slot;
}

void remove_parted(h6Session& s) {
  NearPairs& n = s.near;
  std::size_t kept = 0;
  for (const Near& near : n.all_near()) {
    const Pair& pair = n.pairs[near.slot];
    const bool changed = n.places[pair.a].left || n.places[pair.b].left;
    if (changed && !n.everything && !overlap(n.boxes.of(pair.a), n.boxes.of(pair.b)))
      remove_row(s, near);
    else
      n.near[kept++] = near;
  }
  n.near_count = kept;
}

// Lists the keys of all pairs of body i with bodies whose boxes overlap.
void list_neighbours(h6Session& s, std::uint32_t i, std::size_t& count) {
  NearPairs& n = s.near;
  const auto look = [&](std::uint32_t other) {
    const auto a = static_cast<std::int32_t>(i), b = static_cast<std::int32_t>(other);
    for (const auto& [shell, field] : {std::pair(a, b), std::pair(b, a)}) {
      std::uint64_t key;
      if (!find_key(s, shell, field, key)) continue;
      if (count < n.found.size())
        n.found[count++] = key;
      else
        n.left_out = true;
    }
  };
  if (!n.everything) return n.boxes.each_overlap(n.boxes.of(i), look);
  for (std::uint32_t other = 0; other < s.bodies.size(); ++other) look(other);
}

// Merges the listed keys into the near pairs.
void add_found(h6Session& s, std::size_t count) {
  NearPairs& n = s.near;
  const auto begin = n.found.begin(), all = begin + static_cast<std::ptrdiff_t>(count);
  std::sort(begin, all);
  const auto end = std::unique(begin, all);
  const std::span<const Near> before = n.all_near();
  std::size_t old = 0, out = 0;
  for (auto key = begin; key != end; ++key) {
    while (old < before.size() && before[old].key < *key) n.spare[out++] = before[old++];
    if (old < before.size() && before[old].key == *key) continue;
    Near near{*key, 0};
    if (add_row(s, near))
      n.spare[out++] = near;
    else
      n.left_out = true;
  }
  while (old < before.size()) n.spare[out++] = before[old++];
  std::swap(n.near, n.spare);
  n.near_count = out;
}

// Updates the list for all bodies that have left their boxes.
void update_list(h6Session& s, std::span<const std::uint32_t> bodies) {
  NearPairs& n = s.near;
  n.left_out = false;
  remove_parted(s);
  std::size_t count = 0;
  for (const std::uint32_t i : bodies)
    if (n.places[i].left) list_neighbours(s, i, count);
  add_found(s, count);
}

}  // namespace

sched::HostVector<h6PairDef> sorted_pairs(const h6SessionDef& def) {
  // A stable sort of the library would take its room from the heap.
  sched::HostVector<const h6PairDef*> order(def.pair_count);
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = def.pairs + i;
  std::sort(order.begin(), order.end(), [](const h6PairDef* l, const h6PairDef* r) {
    return l->shell_body != r->shell_body ? l->shell_body < r->shell_body : l < r;
  });
  sched::HostVector<h6PairDef> pairs;
  for (const h6PairDef* pair : order) pairs.push_back(*pair);
  return pairs;
}

void open_near_pairs(h6Session& s) {
  NearPairs& n = s.near;
  sched::HostVector<Box> boxes(s.bodies.size());
  Buffer<bool> moving;
  if (!moving.reserve(s.allocator, s.bodies.size() + 1)) throw std::bad_alloc();
  sched::HostVector<std::uint32_t> all;
  n.lively_count = 0;
  for (std::size_t i = 0; i < s.bodies.size(); ++i) {
    const Body& body = s.bodies[i];
    BodyPlace& place = n.places[i] = {};
    if (body.shell) place.radius = farthest(body.shell->box, body.com);
    if (body.field)
      place.radius = std::max(place.radius, farthest(region_of(s.settings, *body.field), body.com));
    place_body(s.settings, body, place);
    moving[i] = !body.fixed || body.bend;
    boxes[i] = grown(united(place.shell, place.field), moving[i] ? kSlackOfSize * place.radius : 0);
    place.left = true;
    if (moving[i]) n.lively[n.lively_count++] = static_cast<std::uint32_t>(i);
    all.push_back(static_cast<std::uint32_t>(i));
  }
  n.boxes.fill(boxes, {moving.data, s.bodies.size()});
  for (const Near& near : n.all_near()) remove_row(s, near);
  n.near_count = n.awake_count = n.active_count = 0;
  update_list(s, all);
  for (BodyPlace& place : n.places) place.left = false;
}

void find_near_pairs(h6Session& s) {
  NearPairs& n = s.near;
  bool changed = n.left_out;
  for (const std::uint32_t i : n.all_lively()) {
    follow_body(s, i);
    // Where a pair found no room, there may be some now.
    if (n.left_out) n.places[i].left = true;
    changed = changed || n.places[i].left;
  }
  if (changed) update_list(s, n.all_lively());
  if (n.left_out) s.report.status |= H6_PAIRS_LEFT_OUT;
}

void wake_pairs(h6Session& s) {
  NearPairs& n = s.near;
  for (ShellBody* shell : n.all_active()) shell->pairs = {};
  n.awake_count = n.active_count = 0;
  std::size_t first = 0;
  const auto close_shell = [&](std::int32_t body) {
    if (n.awake_count == first) return;
    ShellBody& shell = s.shells[s.bodies[body].meets];
    shell.pairs = PairList(n.awake.subspan(first, n.awake_count - first));
    n.active[n.active_count++] = &shell;
    first = n.awake_count;
  };
  std::int32_t last = -1;
  for (std::size_t i = 0; i < n.near_count; ++i) {
    Pair& pair = n.pairs[n.near[i].slot];
    const Body &a = s.bodies[pair.a], &b = s.bodies[pair.b];
    if (pair.a != last) close_shell(last), last = pair.a;
    const bool far = !overlap(n.places[pair.a].shell, n.places[pair.b].field);
    if (!n.everything && (far || pair.search.quiet.holds(a, b))) {
      put_to_sleep(pair, far);
      continue;
    }
    pair.awake = true;
    pair.search.number = i;
    n.awake[n.awake_count++] = &pair;
  }
  close_shell(last);
  for (ShellBody& shell : s.shells) {
    if (!shell.pairs.empty()) continue;
    shell.contacts.count = 0;
    std::fill_n(shell.series_y, 6, 0.0);
  }
}

bool make_lively(NearPairs& n, std::size_t body) {
  const auto i = static_cast<std::uint32_t>(body);
  const auto end = n.lively.begin() + static_cast<std::ptrdiff_t>(n.lively_count);
  const auto at = std::lower_bound(n.lively.begin(), end, i);
  if (at != end && *at == i) return false;
  std::copy_backward(at, end, end + 1);
  *at = i;
  ++n.lively_count;
  return true;
}

void keep_all_awake(h6Session& s) {
  s.near.everything = s.near.left_out = true;
  find_near_pairs(s);
}

bool may_touch(const h6Session& s, std::int32_t a, std::int32_t b) {
  std::uint64_t key;
  return find_key(s, a, b, key);
}

Pair* find_near_pair(const h6Session& s, std::int32_t a, std::int32_t b) {
  std::uint64_t key;
  if (!find_key(s, a, b, key)) return nullptr;
  const std::span<const Near> near = s.near.all_near();
  const auto at = std::lower_bound(near.begin(), near.end(), key,
                                   [](const Near& n, std::uint64_t k) { return n.key < k; });
  return at != near.end() && at->key == key ? &s.near.pairs[at->slot] : nullptr;
}

}  // namespace h6
