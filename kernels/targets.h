// SPDX-License-Identifier: Apache-2.0
// targets.h - names the SIMD target that the kernels run on, and forces another.
//
// Every kernel is compiled once for each target, and the best one is chosen at run time. Results on
// one target are the same to the bit in every run; between targets they differ by rounding.
#pragma once
#include <cstddef>

namespace h6::kernels {

// The target that a kernel called now runs on: "AVX3", "AVX2", "SSE4", "SSSE3", "SCALAR", ...
// The answer comes from code compiled for that target, through the dispatch that kernels use.
const char* target_name();

// Targets that this machine can run, best first; a forced target does not change the list. Returns
// their number and writes the names of the first `capacity`.
std::size_t supported_targets(const char** names, std::size_t capacity);

// Makes every kernel run on this target from now on. Null: on the one that HAPSIX_SIMD named, else
// on the best. Returns false, and changes nothing, when this machine or build does not have the
// target. Must not be called while kernels run.
bool force_target(const char* name);

// Forces the target that the environment variable HAPSIX_SIMD names. For the main of a program: a
// library leaves the environment of its host alone. Null when the target runs or the variable is
// not set; otherwise one sentence that says why not, and `built` tells whether this build has the
// target, so that only the machine lacks it.
const char* force_target_from_environment(bool* built = nullptr);

}  // namespace h6::kernels
