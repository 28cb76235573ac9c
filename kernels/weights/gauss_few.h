// SPDX-License-Identifier: Apache-2.0
// gauss_few.h - the weights of gauss_weights.h for few contacts: every pair once, without sorting.
#pragma once
#include "kernels/weights/gauss_weights.h"

namespace h6::kernels {

inline constexpr std::size_t kGaussFew = 128;  // contacts at most

// Takes the arguments of gauss_weights_ref, which is the specification. weight (count).
void gauss_weights_few(const DirectionsView& c, Hat hat, const GaussWidths& widths, float* weight);

}  // namespace h6::kernels
