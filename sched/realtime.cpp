// SPDX-License-Identifier: Apache-2.0
// realtime.cpp - core, priority and memory of the haptic thread.
#include "sched/realtime.h"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace h6::sched {
namespace {

void append(RealtimeGrant& grant, const char* format, ...) __attribute__((format(printf, 2, 3)));
void append(RealtimeGrant& grant, const char* format, ...) {
  const std::size_t used = std::strlen(grant.text);
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(grant.text + used, sizeof grant.text - used, format, arguments);
  va_end(arguments);
}

// The first line of a small kernel file; empty where there is no such file.
void read_line(const char* file, char* out, std::size_t size) {
  out[0] = 0;
  const int fd = open(file, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;
  const ssize_t n = read(fd, out, size - 1);
  close(fd);
  out[n > 0 ? n : 0] = 0;
  out[std::strcspn(out, "\n")] = 0;
}

// Is `core` in a list like "1,3-5"?
bool in_list(const char* list, int core) {
  for (const char* at = list; *at;) {
    char* end;
    const long first = std::strtol(at, &end, 10);
    if (end == at) return false;
    const long last = *end == '-' ? std::strtol(end + 1, &end, 10) : first;
    if (core >= first && core <= last) return true;
    at = *end == ',' ? end + 1 : "";
  }
  return false;
}

// Reports settings of the machine: whether the core is isolated, and what governs its clock.
void look_at_core(RealtimeGrant& grant, int core) {
  char list[256], file[96];
  read_line("/sys/devices/system/cpu/isolated", list, sizeof list);
  grant.isolated = in_list(list, core);
  std::snprintf(file, sizeof file, "/sys/devices/system/cpu/cpu%d/cpufreq/scaling_governor", core);
  read_line(file, grant.governor, sizeof grant.governor);
  if (grant.isolated)
    append(grant, " Core %d is isolated.", core);
  else
    append(
        grant,
        " Core %d is not isolated: 'isolcpus=%d nohz_full=%d' on the kernel's command line keeps "
        "other programs off it.",
        core, core, core);
  if (grant.governor[0] && std::strcmp(grant.governor, "performance") != 0)
    append(grant,
           " Its governor is '%s': 'cpupower frequency-set -g performance' keeps its clock up.",
           grant.governor);
}

// The kernel grows a stack page by page with a page fault each. Take them now.
void touch_stack() {
  volatile char page[128 * 1024];
  for (std::size_t i = 0; i < sizeof page; i += 4096) page[i] = 0;
}

// The last core that taskset and cgroup leave to this thread, because the first one serves most
// interrupts; -1: none is known.
int last_of(const cpu_set_t& allowed) {
  for (int core = CPU_SETSIZE - 1; core >= 0; --core)
    if (CPU_ISSET(core, &allowed)) return core;
  return -1;
}

}  // namespace

RealtimeGrant request_realtime(const RealtimeRequest& request) {
  RealtimeGrant grant;
  cpu_set_t allowed, set;
  CPU_ZERO(&allowed);
  pthread_getaffinity_np(pthread_self(), sizeof allowed, &allowed);
  const int core = request.core >= 0 ? request.core : last_of(allowed);
  const bool may = core >= 0 && core < CPU_SETSIZE && CPU_ISSET(core, &allowed);
  CPU_ZERO(&set);
  if (may) CPU_SET(core, &set);
  int refused = may ? pthread_setaffinity_np(pthread_self(), sizeof set, &set) : EINVAL;
  grant.pinned = refused == 0;
  grant.core = grant.pinned ? core : -1;
  if (grant.pinned)
    append(grant, "pinned to core %d. ", core);
  else
    append(grant, "not pinned to core %d (%s): choose one that 'taskset' and the cgroup allow. ",
           core, std::strerror(refused));

  sched_param parameters{};
  parameters.sched_priority = request.priority;
  refused = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
  grant.fifo = refused == 0;
  if (grant.fifo)
    append(grant, "SCHED_FIFO priority %d. ", request.priority);
  else
    append(grant,
           "no SCHED_FIFO (%s): allow it with '<user> - rtprio 99' in /etc/security/limits.conf "
           "and log in again. ",
           std::strerror(refused));

  // Only present memory: with MCL_FUTURE the host program's next malloc could fail.
  grant.locked = mlockall(MCL_CURRENT) == 0;
  if (grant.locked)
    append(grant, "memory locked.");
  else
    append(grant,
           "memory not locked (%s): allow it with '<user> - memlock unlimited' in "
           "/etc/security/limits.conf.",
           std::strerror(errno));
  look_at_core(grant, core);
  touch_stack();
  return grant;
}

void release_realtime(const RealtimeGrant& grant) {
  if (grant.locked) munlockall();
}

#if defined(__SSE__)
FlushDenormals::FlushDenormals() : saved_(_mm_getcsr()) {
  _mm_setcsr(static_cast<unsigned>(saved_) | 0x8040u);  // FTZ | DAZ
}
FlushDenormals::~FlushDenormals() { _mm_setcsr(static_cast<unsigned>(saved_)); }
#elif defined(__aarch64__)
FlushDenormals::FlushDenormals() {
  asm volatile("mrs %0, fpcr" : "=r"(saved_));
  asm volatile("msr fpcr, %0" ::"r"(saved_ | (1ul << 24)));
}
FlushDenormals::~FlushDenormals() { asm volatile("msr fpcr, %0" ::"r"(saved_)); }
#else
FlushDenormals::FlushDenormals() : saved_(0) {}
FlushDenormals::~FlushDenormals() = default;
#endif

}  // namespace h6::sched
