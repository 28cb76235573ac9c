// SPDX-License-Identifier: Apache-2.0
// halt_list.h - what a process must halt before it ends, however it ends: by exit, from a signal
// handler, from any thread.
#pragma once
#include <cstddef>

namespace h6::sched {

inline constexpr std::size_t kMostToHalt = 64;

// `halt(self)` must be fit for a signal handler. false: the list is full. What is in it is halted
// by exit() and quick_exit(), too, in the process that put it there and in no child of it.
bool add_to_halt_list(void (*halt)(void*), void* self);
// Returns when nobody halts `self` any more.
void remove_from_halt_list(void* self);
// Any thread, a signal handler; several times.
void halt_all();

}  // namespace h6::sched
