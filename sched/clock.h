// clock.h - the two clocks of a haptic thread.
#pragma once
#include <cstdint>

namespace h6::sched {

// Nanoseconds of the monotonic clock. Read through the vDSO: no system call, allowed in a frame.
std::int64_t now_ns();

// Nanoseconds of CPU time that the calling thread has used. A system call: outside the frame only.
std::int64_t thread_cpu_ns();

// Sleeps until the monotonic clock shows `deadline_ns`; returns at once when that has passed.
void sleep_until_ns(std::int64_t deadline_ns);

}  // namespace h6::sched
