// SPDX-License-Identifier: Apache-2.0
// halt_list.h - devices that must be halted before the process ends, by exit or by a signal
// handler, from any thread.
#pragma once
#include <cstddef>

namespace h6::sched {

inline constexpr std::size_t kMostToHalt = 64;

// `halt(self)` must be safe in a signal handler. exit() and quick_exit() call it too, in the
// process that added it and in no child. False when the list is full.
bool add_to_halt_list(void (*halt)(void*), void* self);
// Returns once no call of halt(self) is running any more.
void remove_from_halt_list(void* self);
// Calls every halt(self). From any thread or signal handler, any number of times.
void halt_all();

}  // namespace h6::sched
