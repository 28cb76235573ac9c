#include "runtime/anytime.h"

#include <algorithm>

#include "runtime/session.h"
#include "sched/clock.h"

namespace h6 {
namespace {

// A stolen millisecond may at most double a cost, and half of that is forgotten in 140 frames.
void learn(double& cost, double seen) {
  cost = seen > cost ? std::min(seen, 2 * cost) : cost + 0.005 * (seen - cost);
}

// Fewer say nothing about the cost of one.
constexpr std::size_t kTelling = 64;
constexpr double kForget = 0.9999;

}  // namespace

void begin_anytime(h6Session& s, std::int64_t start) {
  Anytime& a = s.anytime;
  a.start = start;
  a.coarse = false;
  a.by_clock = a.forced == Anytime::kByClock && a.budget_ns > 0 && !a.no_clock;
  if (a.forced == Anytime::kByClock) return;
  s.report.coarse_pairs = static_cast<std::uint32_t>(std::min<std::size_t>(a.forced, s.pair_count));
  if (s.report.coarse_pairs > 0) s.report.status |= H6_COARSE;
  a.forced = Anytime::kByClock;
}

bool must_be_coarse(h6Session& s, std::size_t pair, std::size_t used, std::size_t groups) {
  Anytime& a = s.anytime;
  if (!a.by_clock) return pair + s.report.coarse_pairs >= s.pair_count;
  if (a.coarse) return true;
  const double n = static_cast<double>(groups);
  const double contacts = static_cast<double>(used) + n * a.contacts_per_group;
  const double elapsed = static_cast<double>(sched::now_ns() - a.start);
  a.coarse = elapsed + n * a.group_ns + contacts * a.contact_ns + a.rest_ns > a.budget_ns;
  if (!a.coarse) return false;
  s.report.coarse_pairs = static_cast<std::uint32_t>(s.pair_count - pair);
  s.report.status |= H6_COARSE;
  return true;
}

void learn_sampling(h6Session& s, std::size_t groups, std::size_t found, std::int64_t since) {
  Anytime& a = s.anytime;
  if (!a.by_clock || groups < kTelling) return;
  const double n = static_cast<double>(groups);
  learn(a.group_ns, static_cast<double>(sched::now_ns() - since) / n);
  learn(a.contacts_per_group, static_cast<double>(found) / n);
}

// One point of a group was looked at instead of sixteen.
void learn_coarsely(h6Session& s, std::size_t groups, std::size_t found) {
  Anytime& a = s.anytime;
  if (!a.by_clock || groups < kTelling) return;
  learn(a.contacts_per_group, 16 * static_cast<double>(found) / static_cast<double>(groups));
}

void learn_frame(h6Session& s) {
  Anytime& a = s.anytime;
  if (!a.by_clock) return;
  const double* us = s.report.stage_us;
  learn(a.rest_ns, 1e3 * (us[H6_STAGE_COUPLING] + us[H6_STAGE_INTEGRATE] + us[H6_STAGE_OUTPUT]));
  if (a.coarse) {
    // Few contacts are cheaper than many, each: what a full frame costs is only seen in one. To try
    // one means to be late where it still does not fit, so that takes its time: 1 % in 100 frames.
    a.contact_ns *= kForget;
    a.group_ns *= kForget;
    return;
  }
  const double spent = us[H6_STAGE_CONTACTS] + us[H6_STAGE_WEIGHTS] + us[H6_STAGE_WRENCH];
  if (s.report.contacts >= kTelling) learn(a.contact_ns, 1e3 * spent / s.report.contacts);
}

}  // namespace h6
