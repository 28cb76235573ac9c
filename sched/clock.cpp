#include "sched/clock.h"

#include <cerrno>
#include <ctime>

namespace h6::sched {
namespace {
std::int64_t read_ns(clockid_t clock) {
  timespec t;
  clock_gettime(clock, &t);
  return t.tv_sec * std::int64_t{1000000000} + t.tv_nsec;
}
}  // namespace

std::int64_t now_ns() { return read_ns(CLOCK_MONOTONIC); }
std::int64_t thread_cpu_ns() { return read_ns(CLOCK_THREAD_CPUTIME_ID); }

void sleep_until_ns(std::int64_t deadline_ns) {
  const timespec t{static_cast<time_t>(deadline_ns / 1000000000), deadline_ns % 1000000000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

}  // namespace h6::sched
