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

// Fewer say nothing about the cost of one; coarse frames have a sixteenth.
constexpr std::size_t kTelling = 64, kTellingCoarse = 32;
constexpr double kForget = 0.9999, kForgetGuess = 0.999;
// What a contact of a full frame costs where one of a coarse frame costs 1. In a socket with 9,627
// contacts, 616 of them in a coarse frame: 2.0 for `robust` (99 and 50 ns), 1.5 for `gauss6`.
constexpr double kCrowding = 2.0;
constexpr double kInTime = 0.95;        // of the period: a frame that takes less is not late
constexpr double kPatience = 30;        // between tries of what does not seem to fit [s]
constexpr std::uint32_t kSettled = 50;  // coarse frames until their cost is known

double middle_of(const double (&seen)[3], std::uint32_t count) {
  if (count < 3) return *std::min_element(seen, seen + std::max(count, 1u));
  return std::max(std::min(seen[0], seen[1]), std::min(std::max(seen[0], seen[1]), seen[2]));
}

// Of a full frame's contact, now [ns].
double full_contact_ns(const Anytime& a) {
  if (a.full_frames == 0)
    return a.coarse_contact_ns > 0 ? kCrowding * a.coarse_contact_ns : a.contact_ns;
  if (!(a.coarse_then > 0)) return a.contact_ns;
  return a.contact_ns * std::clamp(a.coarse_contact_ns / a.coarse_then, 0.5, 1.0);
}

// So that what did not fit is tried again, but only where it would not be late.
void grow_doubtful(h6Session& s) {
  Anytime& a = s.anytime;
  if (a.full_frames == 0 && !(a.coarse_contact_ns > 0)) {
    a.doubt *= kForgetGuess;
    return;
  }
  const double period = 1e9 * s.dt;
  const bool in_time = a.full_ns <= kInTime * period;
  a.doubt = in_time ? std::max(kForget * a.doubt, std::min(1.0, a.budget_ns / period)) : 1.0;
}

}  // namespace

void begin_anytime(h6Session& s, std::int64_t start) {
  Anytime& a = s.anytime;
  a.start = start;
  a.coarse = a.trying = false;
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
  if (a.trying) return false;
  const double n = static_cast<double>(groups);
  const double contacts = static_cast<double>(used) + n * a.contacts_per_group;
  const double elapsed = static_cast<double>(sched::now_ns() - a.start);
  a.full_ns = elapsed + n * a.group_ns + contacts * full_contact_ns(a) + a.rest_ns;
  if (a.full_ns * a.doubt <= a.budget_ns) return false;
  const bool may_fit = 0.5 * a.full_ns <= a.budget_ns;  // if what was learnt was a bad day
  a.trying = may_fit && groups > 0 && a.next_try > 0 && a.coarse_frames >= a.next_try;
  if (a.trying) return false;
  a.coarse = true;
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
  const double spent = 1e3 * (us[H6_STAGE_CONTACTS] + us[H6_STAGE_WEIGHTS] + us[H6_STAGE_WRENCH]);
  if (a.coarse) {
    ++a.coarse_frames;
    if (s.report.contacts >= kTellingCoarse) {
      const double each = spent / s.report.contacts;
      double& cost = a.coarse_contact_ns;
      cost = cost > 0 ? cost + 0.02 * (std::min(each, 2 * cost) - cost) : each;
      if (!(a.coarse_then > 0) && a.full_frames > 0 && a.coarse_frames >= kSettled)
        a.coarse_then = cost;
    }
    a.group_ns = std::max(10.0, a.group_ns * kForget);
    if (a.next_try == 0) a.next_try = static_cast<std::uint64_t>(kPatience / s.dt);
    grow_doubtful(s);
    return;
  }
  if (a.trying) {
    const bool late = static_cast<double>(sched::now_ns() - a.start) > 1e9 * s.dt;
    a.in_vain = late ? std::min(a.in_vain + 1, 10u) : 0;
    if (!late) a.full_frames = 0;  // what was known before is out of date
    a.next_try = static_cast<std::uint64_t>(kPatience / s.dt) << a.in_vain;
  }
  a.doubt = 1;
  a.coarse_frames = 0;
  if (s.report.contacts < kTelling) return;
  const double now = spent / s.report.contacts;
  a.seen[2] = a.seen[1], a.seen[1] = a.seen[0], a.seen[0] = now;
  // One frame in three may have been robbed of its time.
  if (a.full_frames == 0)
    a.contact_ns = now;
  else
    learn(a.contact_ns, middle_of(a.seen, std::min(a.full_frames + 1, 3u)));
  a.full_frames = std::min(a.full_frames + 1, 3u);
  a.coarse_then = a.coarse_contact_ns;
}

}  // namespace h6
