// SPDX-License-Identifier: Apache-2.0
// clock.cpp - reads the clocks.
#include "sched/clock.h"

#include <cerrno>
#include <ctime>

#if defined(__x86_64__)
#include <cpuid.h>
#include <x86intrin.h>
#endif

namespace h6::sched {
namespace {
std::int64_t read_ns(clockid_t clock) {
  timespec t;
  clock_gettime(clock, &t);
  return t.tv_sec * std::int64_t{1000000000} + t.tv_nsec;
}

constexpr std::int64_t kSecond = 1000000000;

#if defined(__x86_64__)
bool counter_is_invariant() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(0x80000007u, &a, &b, &c, &d) != 0 && (d >> 8 & 1u) != 0;
}
const bool by_counter = counter_is_invariant();
#endif
}  // namespace

std::int64_t ticks() {
#if defined(__x86_64__)
  if (by_counter) return static_cast<std::int64_t>(__rdtsc());
#endif
  return now_ns();
}

void TickLength::see(std::int64_t now_ns, std::int64_t ticks) {
  const std::int64_t ns = now_ns - since_ns_, counted = ticks - since_ticks_;
  const bool begun = since_ns_ != 0, whole = ns > kSecond;
  // During the first second this is a first estimate.
  if (begun && ns > 0 && counted > 0 && (whole || !known_)) {
    ns_ = static_cast<double>(ns) / static_cast<double>(counted);
    known_ = whole;
  }
  if (!begun || whole || counted < 0) since_ns_ = now_ns, since_ticks_ = ticks;
}

std::int64_t now_ns() { return read_ns(CLOCK_MONOTONIC); }
std::int64_t thread_cpu_ns() { return read_ns(CLOCK_THREAD_CPUTIME_ID); }

void sleep_until_ns(std::int64_t deadline_ns) {
  const timespec t{static_cast<time_t>(deadline_ns / 1000000000), deadline_ns % 1000000000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

}  // namespace h6::sched
