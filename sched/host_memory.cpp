// SPDX-License-Identifier: Apache-2.0
// host_memory.cpp - the allocator of the innermost scope of each thread.
#include "sched/host_memory.h"

namespace h6::sched {
namespace {
thread_local constinit h6Allocator now{};
}  // namespace

HostScope::HostScope(const h6Allocator& a) : before_(now) { now = a; }
HostScope::~HostScope() { now = before_; }
const h6Allocator& HostScope::current() { return now; }

}  // namespace h6::sched
