// SPDX-License-Identifier: Apache-2.0
// targets.h - which SIMD instruction set the kernels run on, and how a test picks another.
//
// Every kernel is compiled once for each target and chooses at run time; results agree bit for bit
// between runs on one target, within rounding between targets.
#pragma once
#include <cstddef>

namespace h6::kernels {

// The target that a kernel called now runs on: "AVX3", "AVX2", "SSE4", "SSSE3", "SCALAR", ...
// Answered from code compiled for that target, through the kernels' own dispatch.
const char* target_name();

// Targets that this machine can run, best first, whatever is forced. Returns how many there are and
// writes the names of the first `capacity`.
std::size_t supported_targets(const char** names, std::size_t capacity);

// Makes every kernel run on this target from now on; null: the best again. False when this machine
// or build does not have it; nothing changes then. Not while kernels run.
bool force_target(const char* name);

}  // namespace h6::kernels
