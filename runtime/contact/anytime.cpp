// SPDX-License-Identifier: Apache-2.0
// anytime.cpp - learns the costs of a frame's work and chooses the tier that fits the budget.
#include "runtime/contact/anytime.h"

#include <algorithm>
#include <bit>

namespace h6 {
namespace {

// If the machine steals a millisecond, that at most doubles a cost, and half of the increase is
// forgotten in 140 frames.
void learn(double& cost, double seen) {
  cost = seen > cost ? std::min(seen, 2 * cost) : cost + 0.005 * (seen - cost);
}

constexpr std::size_t kTelling = 32;    // fewer contacts say nothing about the cost of one
constexpr double kUnknown = 200;        // cost of a contact before any was seen [ns]
constexpr double kSpare = 0.85;         // share of the budget that a finer tier may take
constexpr std::uint32_t kCalm = 20;     // frames until a finer tier is allowed
constexpr std::uint32_t kStrikes = 3;   // frames until the finest tier is no longer allowed
constexpr std::uint64_t kFresh = 1000;  // frames until a cost is out of date
// The cost of a contact is extrapolated to more contacts with 1.25 times the slope seen so far, but
// at least a quarter of proportional growth: `robust` takes 50 ns per contact for 616 contacts and
// 99 ns for 9,627.
constexpr double kLeastGrowth = 0.25, kGrowth = 1.25;
constexpr std::uint32_t kLookEvery = 16;  // frames between two counts of near groups
constexpr double kLookNs = 60;            // time to test a group that is in no cache

double middle_of(const double (&seen)[3], std::uint32_t count) {
  if (count < 3) return *std::min_element(seen, seen + std::max(count, 1u));
  return std::max(std::min(seen[0], seen[1]), std::min(std::max(seen[0], seen[1]), seen[2]));
}

int size_of(double contacts) {
  const auto n = static_cast<std::uint32_t>(std::max(contacts, 1.0));
  return static_cast<int>(std::bit_width(n)) - 1;
}

// An upper bound on the cost of one contact in a frame of `contacts` [ns].
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
  // So few contacts were never seen. One of them costs no more than one of many.
  for (int i = size + 1; i < Anytime::kSizes; ++i)
    if (a.contact[i].times > 0) return a.contact[i].ns;
  return kUnknown;
}

// A frame that cannot keep its budget may end halfway between the budget and the deadline.
double latest_ns(const Anytime& a) { return 0.5 * (a.budget_ns + a.period_ns) / a.steps; }

// All steps of a frame share its budget.
double budget_ns(const Anytime& a) { return a.budget_ns / a.steps; }

double elapsed_ns(const Anytime& a) { return static_cast<double>(a.clock() - a.start); }

// The work so far, and the work that remains in this pair and in all later ones if these are as in
// the last frame.
struct Ahead {
  double elapsed, used;
  double blocks = 0, groups = 0;
};

Ahead look_ahead(const Anytime& a, const PairSearch& pair, std::size_t used, std::size_t blocks,
                 double groups) {
  Ahead ahead{elapsed_ns(a), static_cast<double>(used), static_cast<double>(blocks), groups};
  for (const Pair& next : a.pairs) {
    if (next.search.number <= pair.number) continue;
    ahead.blocks += static_cast<double>(next.search.open_blocks);
    ahead.groups += static_cast<double>(next.search.open_groups);
  }
  return ahead;
}

// The time of the whole frame if its rest is traversed in `tier` [ns].
double foresee(const Anytime& a, const Ahead& ahead, int tier) {
  const double share = static_cast<double>(1 << tier) / 16;
  const double sampled = tier == Anytime::kAll ? ahead.groups : 16 * share * ahead.blocks;
  const double contacts = ahead.used + ahead.groups * a.contacts_per_group * share;
  return ahead.elapsed + sampled * a.group_ns + contacts * contact_ns(a, contacts) + a.rest_ns;
}

// The finest tier for the rest of the frame.
int choose(Anytime& a, const Ahead& ahead) {
  // If nothing is known, it begins with the coarsest tier. On the way up it sees the cost of each
  // number of contacts.
  if (!a.begun && ahead.groups > 0) {
    a.begun = true;
    if (foresee(a, ahead, Anytime::kAll) > kSpare * budget_ns(a)) a.finest = 0;
  }
  int fits = std::min(a.finest + 1, Anytime::kAll);
  while (fits > 0 && foresee(a, ahead, fits) > kSpare * budget_ns(a)) --fits;
  a.fitting = std::min(a.fitting, fits);
  int tier = a.finest;
  while (tier > 0 && tier > fits && foresee(a, ahead, tier) > budget_ns(a)) --tier;
  return tier;
}

void become_coarse(Anytime& a, std::size_t pair, int tier) {
  a.coarse = true;
  a.tier = tier;
  a.coarse_pairs = static_cast<std::uint32_t>(a.near - pair);
}

bool decide(Anytime& a, const Ahead& ahead, const PairSearch& pair) {
  const int tier = choose(a, ahead);
  if (tier < Anytime::kAll) become_coarse(a, pair.number, tier);
  return a.coarse;
}

void learn_contacts(Anytime& a, double contacts, double spent) {
  if (contacts < kTelling) return;
  Anytime::Cost& c = a.contact[size_of(contacts)];
  if (a.frames - c.when >= kFresh) c.times = 0;  // the old cost is out of date
  c.seen[2] = c.seen[1], c.seen[1] = c.seen[0], c.seen[0] = spent / contacts;
  const bool first = c.times < 3;
  c.times = std::min(c.times + 1, 3u);
  // The machine may have stolen time from one frame in three.
  const double now = middle_of(c.seen, c.times);
  if (first)
    c.ns = now, c.contacts = contacts;
  else
    learn(c.ns, now), c.contacts += 0.1 * (contacts - c.contacts);
  c.when = a.frames;
}

}  // namespace

void begin_anytime(Anytime& a, std::int64_t start, std::uint32_t steps) {
  a.start = start;
  a.steps = steps;
  a.coarse = false;
  a.coarse_pairs = 0;
  a.few = false;
  a.fitting = Anytime::kAll;
  a.by_clock = a.forced == Anytime::kByClock && a.budget_ns > 0 && !a.no_clock;
  if (a.forced == Anytime::kByClock) return;
  a.coarse_pairs = a.forced;
  a.tier = std::bit_width(std::max(a.forced_points, 1u)) - 1;
  a.few = a.coarse_pairs > 0 && a.forced_points == 0;
  a.forced = Anytime::kByClock;
}

void begin_traversal(Anytime& a, PairList pairs, std::size_t near, bool first) {
  a.pairs = pairs;
  a.near = near;
  if (first)
    a.coarse_pairs = static_cast<std::uint32_t>(std::min<std::size_t>(a.coarse_pairs, near));
}

void decide_no_more(Anytime& a) { a.by_clock = false; }

bool is_coarse_anyway(Anytime& a, const PairSearch& pair, std::size_t used, std::size_t blocks) {
  if (!a.by_clock) return pair.number + a.coarse_pairs >= a.near;
  if (a.coarse) return true;
  const double n = static_cast<double>(blocks), look = 16 * n * kLookNs;
  const double each = pair.open_blocks == 0 ? 16
                                            : static_cast<double>(pair.open_groups) /
                                                  static_cast<double>(pair.open_blocks);
  const Ahead ahead = look_ahead(a, pair, used, blocks, each * n);
  // Testing the groups is itself a part of the work, so it is done only now and then.
  const bool room = look + foresee(a, ahead, 0) <= kSpare * budget_ns(a);
  if (!a.begun ? look <= 0.5 * budget_ns(a)
               : a.finest == Anytime::kAll || (room && a.frames % kLookEvery == 0))
    return false;
  return decide(a, ahead, pair);
}

bool must_be_coarse(Anytime& a, PairSearch& pair, std::size_t used, std::size_t blocks,
                    std::size_t groups) {
  pair.open_blocks = blocks, pair.open_groups = groups;
  if (!a.by_clock) return false;
  return decide(a, look_ahead(a, pair, used, blocks, static_cast<double>(groups)), pair);
}

bool must_be_coarser(Anytime& a, const PairSearch& pair, std::size_t used, std::size_t found,
                     std::size_t blocks) {
  const int tier = a.coarse ? a.tier : Anytime::kAll;
  // All coarse pairs of a frame have the same tier, so only the first of them may change it.
  if (!a.by_clock || tier == 0 || (a.coarse && pair.number + a.coarse_pairs != a.near))
    return false;
  const double most = latest_ns(a), n = static_cast<double>(used + found);
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
  become_coarse(a, pair.number, coarser);
  return true;
}

bool must_be_few(Anytime& a, const PairSearch& first, std::size_t found) {
  if (!a.by_clock || a.few) return a.few;
  // The coarse pairs of earlier shell bodies have their contacts already.
  if (!a.coarse || a.tier > 0 || a.coarse_pairs + first.number > a.near) return false;
  // The cost of so many contacts must be measured now and then, or frames would keep few for ever.
  // The first frame reads everything from memory, so its time tells nothing.
  const double n = static_cast<double>(found);
  const Anytime::Cost& seen = a.contact[size_of(n)];
  if (a.frames > 0 && (seen.times == 0 || a.frames - seen.when >= kFresh)) return false;
  if (elapsed_ns(a) + n * contact_ns(a, n) + a.rest_ns <= latest_ns(a)) return false;
  a.few = true;
  return true;
}

std::size_t coarse_pairs_of(const Anytime& a, PairList pairs) {
  std::size_t count = 0;
  for (const Pair& pair : pairs) count += pair.search.number + a.coarse_pairs >= a.near;
  return count;
}

void learn_sampling(Anytime& a, std::size_t groups, std::size_t near, std::size_t found,
                    std::int64_t since) {
  if (!a.by_clock || groups < kTelling || near < kTelling) return;
  learn(a.group_ns, static_cast<double>(a.clock() - since) / static_cast<double>(groups));
  const double all = a.coarse ? static_cast<double>(found << (Anytime::kAll - a.tier))
                              : static_cast<double>(found);
  learn(a.contacts_per_group, all / static_cast<double>(near));
}

void learn_frame(Anytime& a, const h6FrameReport& report) {
  if (!a.by_clock) return;
  ++a.frames;
  const double* us = report.stage_us;
  learn(a.rest_ns, 1e3 * (us[H6_STAGE_COUPLING] + us[H6_STAGE_INTEGRATE] + us[H6_STAGE_OUTPUT]));
  std::size_t contacts = 0;
  for (const Pair& pair : a.pairs) contacts += pair.search.candidates;
  if (!a.few)
    learn_contacts(a, static_cast<double>(contacts),
                   1e3 * (us[H6_STAGE_CONTACTS] + us[H6_STAGE_WEIGHTS] + us[H6_STAGE_WRENCH]));
  const int tier = a.coarse ? a.tier : Anytime::kAll;
  a.calm = a.fitting > a.finest ? a.calm + 1 : 0;
  a.strikes = tier < a.finest ? a.strikes + 1 : 0;
  if (a.strikes >= kStrikes) a.finest = tier, a.strikes = 0;
  if (a.calm >= kCalm) ++a.finest, a.calm = 0;
}

void report_anytime(const Anytime& a, h6FrameReport& report) {
  if (a.coarse_pairs == 0) return;
  report.status |= H6_COARSE;
  report.coarse_pairs = a.coarse_pairs;
  report.coarse_points = a.few ? 0 : 1u << a.tier;
}

}  // namespace h6
