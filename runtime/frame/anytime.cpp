// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame/anytime.h"

#include <algorithm>
#include <bit>

#include "runtime/frame/session.h"

namespace h6 {
namespace {

// A stolen millisecond may at most double a cost, and half of that is forgotten in 140 frames.
void learn(double& cost, double seen) {
  cost = seen > cost ? std::min(seen, 2 * cost) : cost + 0.005 * (seen - cost);
}

// Fewer say nothing about the cost of one.
constexpr std::size_t kTelling = 32;
constexpr double kUnknown = 200;        // ns a contact
constexpr double kSpare = 0.85;         // of the budget: what a finer tier may take
constexpr std::uint32_t kCalm = 20;     // frames until a finer tier is allowed
constexpr std::uint32_t kStrikes = 3;   // until it is not any more
constexpr std::uint64_t kFresh = 1000;  // frames for which a cost is believed as it is
// A contact costs more where there are more: at least by so much of the proportion, and 1.25 times
// what it did so far. In a socket with 9,627 contacts `robust` takes 99 ns for one, with 616 of
// them 50.
constexpr double kLeastGrowth = 0.25, kGrowth = 1.25;
constexpr std::uint32_t kLookEvery = 16;  // frames: how many groups are near
constexpr double kLookNs = 60;            // a group, when nothing of them is in the caches

double middle_of(const double (&seen)[3], std::uint32_t count) {
  if (count < 3) return *std::min_element(seen, seen + std::max(count, 1u));
  return std::max(std::min(seen[0], seen[1]), std::min(std::max(seen[0], seen[1]), seen[2]));
}

int size_of(double contacts) {
  const auto n = static_cast<std::uint32_t>(std::max(contacts, 1.0));
  return static_cast<int>(std::bit_width(n)) - 1;
}

// Of one of `contacts`, at most [ns].
double contact_ns(const Anytime& a, double contacts) {
  const int size = size_of(contacts);
  const auto below = [&](int i) {
    while (--i >= 0 && a.contact[i].times == 0) {
    }
    return i;
  };
  const Anytime::Cost& same = a.contact[size];
  const bool known = same.times > 0;
  const int fewer = below(size);
  const auto from = [&](const Anytime::Cost& c, int i) {
    if (contacts <= c.contacts) return c.ns;
    const double most = c.ns / c.contacts;
    double growth = most;
    if (const int before = below(i); before >= 0) {
      const Anytime::Cost& b = a.contact[before];
      growth = std::clamp(kGrowth * (c.ns - b.ns) / (c.contacts - b.contacts), kLeastGrowth * most,
                          most);
    }
    return c.ns + growth * (contacts - c.contacts);
  };
  if (known && (fewer < 0 || a.frames - same.when < kFresh)) return from(same, size);
  if (fewer >= 0) {
    const double bound = from(a.contact[fewer], fewer);
    return known ? std::min(bound, from(same, size)) : bound;
  }
  // Fewer than ever: none of them costs more than one of many.
  for (int i = size + 1; i < Anytime::kSizes; ++i)
    if (a.contact[i].times > 0) return a.contact[i].ns;
  return kUnknown;
}

// Of a frame that cannot keep its budget any more: halfway from there to being late.
double latest_ns(const h6Session& s) { return 0.5 * (s.anytime.budget_ns + 1e9 * s.dt); }

double elapsed_ns(const Anytime& a) { return static_cast<double>(a.clock() - a.start); }

// What a frame takes from its beginning when this pair and all that follow (as they were last) are
// traversed in `tier`.
struct Ahead {
  double elapsed, used;
  double blocks = 0, groups = 0;
};

Ahead look_ahead(const h6Session& s, std::size_t pair, std::size_t used, std::size_t blocks,
                 double groups) {
  Ahead ahead{elapsed_ns(s.anytime), static_cast<double>(used), static_cast<double>(blocks),
              groups};
  for (std::size_t p = pair + 1; p < s.pair_count; ++p) {
    ahead.blocks += static_cast<double>(s.pairs[p].open_blocks);
    ahead.groups += static_cast<double>(s.pairs[p].open_groups);
  }
  return ahead;
}

double foresee(const Anytime& a, const Ahead& ahead, int tier) {
  const double share = static_cast<double>(1 << tier) / 16;
  const double sampled = tier == Anytime::kAll ? ahead.groups : 16 * share * ahead.blocks;
  const double contacts = ahead.used + ahead.groups * a.contacts_per_group * share;
  return ahead.elapsed + sampled * a.group_ns + contacts * contact_ns(a, contacts) + a.rest_ns;
}

// The finest tier for the rest of the frame.
int choose(Anytime& a, const Ahead& ahead) {
  // Where nothing is known, from below: on the way up each size's cost is seen.
  if (!a.begun && ahead.groups > 0) {
    a.begun = true;
    if (foresee(a, ahead, Anytime::kAll) > kSpare * a.budget_ns) a.finest = 0;
  }
  int fits = std::min(a.finest + 1, Anytime::kAll);
  while (fits > 0 && foresee(a, ahead, fits) > kSpare * a.budget_ns) --fits;
  a.fitting = std::min(a.fitting, fits);
  int tier = a.finest;
  while (tier > 0 && tier > fits && foresee(a, ahead, tier) > a.budget_ns) --tier;
  return tier;
}

void become_coarse(h6Session& s, std::size_t pair, int tier) {
  s.anytime.coarse = true;
  s.anytime.tier = tier;
  s.report.coarse_pairs = static_cast<std::uint32_t>(s.pair_count - pair);
  s.report.coarse_points = 1u << tier;
  s.report.status |= H6_COARSE;
}

bool decide(h6Session& s, const Ahead& ahead, std::size_t pair) {
  const int tier = choose(s.anytime, ahead);
  if (tier < Anytime::kAll) become_coarse(s, pair, tier);
  return s.anytime.coarse;
}

void learn_contacts(Anytime& a, double contacts, double spent) {
  if (contacts < kTelling) return;
  Anytime::Cost& c = a.contact[size_of(contacts)];
  if (a.frames - c.when >= kFresh) c.times = 0;  // what was known before is out of date
  c.seen[2] = c.seen[1], c.seen[1] = c.seen[0], c.seen[0] = spent / contacts;
  const bool first = c.times < 3;
  c.times = std::min(c.times + 1, 3u);
  // One frame in three may have been robbed of its time.
  const double now = middle_of(c.seen, c.times);
  if (first)
    c.ns = now, c.contacts = contacts;
  else
    learn(c.ns, now), c.contacts += 0.1 * (contacts - c.contacts);
  c.when = a.frames;
}

}  // namespace

void begin_anytime(h6Session& s, std::int64_t start) {
  Anytime& a = s.anytime;
  a.start = start;
  a.coarse = false;
  a.few = false;
  a.fitting = Anytime::kAll;
  a.by_clock = a.forced == Anytime::kByClock && a.budget_ns > 0 && !a.no_clock;
  if (a.forced == Anytime::kByClock) return;
  const std::size_t pairs = std::min<std::size_t>(a.forced, s.pair_count);
  const std::uint32_t points = std::max(a.forced_points, 1u);
  if (pairs > 0) become_coarse(s, s.pair_count - pairs, std::bit_width(points) - 1);
  a.coarse = false;  // pair by pair
  a.few = pairs > 0 && a.forced_points == 0;
  if (a.few) s.report.coarse_points = 0;
  a.forced = Anytime::kByClock;
}

bool is_coarse_anyway(h6Session& s, std::size_t pair, std::size_t used, std::size_t blocks) {
  const Anytime& a = s.anytime;
  if (!a.by_clock) return pair + s.report.coarse_pairs >= s.pair_count;
  if (a.coarse) return true;
  const Pair& p = s.pairs[pair];
  const double n = static_cast<double>(blocks), look = 16 * n * kLookNs;
  const double each = p.open_blocks == 0
                          ? 16
                          : static_cast<double>(p.open_groups) / static_cast<double>(p.open_blocks);
  const Ahead ahead = look_ahead(s, pair, used, blocks, each * n);
  // To look at the groups is itself some of the work; to do it now and then is enough.
  const bool room = look + foresee(a, ahead, 0) <= kSpare * a.budget_ns;
  if (!a.begun ? look <= 0.5 * a.budget_ns
               : a.finest == Anytime::kAll || (room && a.frames % kLookEvery == 0))
    return false;
  return decide(s, ahead, pair);
}

bool must_be_coarse(h6Session& s, std::size_t pair, std::size_t used, std::size_t blocks,
                    std::size_t groups) {
  Pair& p = s.pairs[pair];
  p.open_blocks = blocks, p.open_groups = groups;
  if (!s.anytime.by_clock) return false;
  return decide(s, look_ahead(s, pair, used, blocks, static_cast<double>(groups)), pair);
}

bool must_be_coarser(h6Session& s, std::size_t pair, std::size_t used, std::size_t found,
                     std::size_t blocks) {
  Anytime& a = s.anytime;
  const int tier = a.coarse ? a.tier : Anytime::kAll;
  // All coarse pairs of a frame are so in the same tier.
  if (!a.by_clock || tier == 0 || (a.coarse && pair + s.report.coarse_pairs != s.pair_count))
    return false;
  const double most = latest_ns(s), n = static_cast<double>(used + found);
  const double elapsed = elapsed_ns(a);
  if (elapsed + n * contact_ns(a, n) + a.rest_ns <= most) return false;
  int coarser = tier;
  double ahead;
  do {
    --coarser;
    const double share = static_cast<double>(1 << coarser) / (1 << tier);
    const double left = static_cast<double>(used) + share * static_cast<double>(found);
    ahead = elapsed + (1 << coarser) * static_cast<double>(blocks) * a.group_ns +
            left * contact_ns(a, left) + a.rest_ns;
  } while (coarser > 0 && ahead > most);
  become_coarse(s, pair, coarser);
  return true;
}

bool must_be_few(h6Session& s, std::size_t first, std::size_t found) {
  Anytime& a = s.anytime;
  if (!a.by_clock || a.few) return a.few;
  // What was coarse in shell bodies before this one has its contacts by now.
  if (!a.coarse || a.tier > 0 || s.report.coarse_pairs + first > s.pair_count) return false;
  // What so many cost is to be seen now and then, or few would follow few for ever.
  // The first frame has everything from memory.
  const double n = static_cast<double>(found);
  const Anytime::Cost& seen = a.contact[size_of(n)];
  if (a.frames > 0 && (seen.times == 0 || a.frames - seen.when >= kFresh)) return false;
  if (elapsed_ns(a) + n * contact_ns(a, n) + a.rest_ns <= latest_ns(s)) return false;
  a.few = true;
  s.report.coarse_points = 0;
  return true;
}

void learn_sampling(h6Session& s, std::size_t groups, std::size_t near, std::size_t found,
                    std::int64_t since) {
  Anytime& a = s.anytime;
  if (!a.by_clock || groups < kTelling || near < kTelling) return;
  learn(a.group_ns, static_cast<double>(a.clock() - since) / static_cast<double>(groups));
  const double all = a.coarse ? static_cast<double>(found << (Anytime::kAll - a.tier))
                              : static_cast<double>(found);
  learn(a.contacts_per_group, all / static_cast<double>(near));
}

void learn_frame(h6Session& s) {
  Anytime& a = s.anytime;
  if (!a.by_clock) return;
  ++a.frames;
  const double* us = s.report.stage_us;
  learn(a.rest_ns, 1e3 * (us[H6_STAGE_COUPLING] + us[H6_STAGE_INTEGRATE] + us[H6_STAGE_OUTPUT]));
  std::size_t contacts = 0;
  for (std::size_t p = 0; p < s.pair_count; ++p) contacts += s.pairs[p].candidates;
  if (!a.few)
    learn_contacts(a, static_cast<double>(contacts),
                   1e3 * (us[H6_STAGE_CONTACTS] + us[H6_STAGE_WEIGHTS] + us[H6_STAGE_WRENCH]));
  const int tier = a.coarse ? a.tier : Anytime::kAll;
  a.calm = a.fitting > a.finest ? a.calm + 1 : 0;
  a.strikes = tier < a.finest ? a.strikes + 1 : 0;
  if (a.strikes >= kStrikes) a.finest = tier, a.strikes = 0;
  if (a.calm >= kCalm) ++a.finest, a.calm = 0;
}

}  // namespace h6
