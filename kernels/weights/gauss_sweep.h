// SPDX-License-Identifier: Apache-2.0
// gauss_sweep.h - the weights of gauss_weights.h for some thousand contacts: sorted, so that each
// is compared only with those in a window.
//
// gauss_bands.h sorts the contacts and sums hats over one sphere. A product of two hats costs more,
// so each pair is evaluated once: it joins a sum over lanes for one contact and a sum over rows for
// the other. Where pairs are many, two blocks of contacts whose boxes are farther apart than a hat,
// on either sphere, are passed over. That changes no bit of finite weights, but boxes also decide
// where the parts are split.
//
//     columns -> bands, runs -> sums of rows and of columns, part by part -> weights
//
// Stages and slices work as in gauss_tree.h. Each part has its own sums, which are added in order,
// so the bits do not depend on which thread runs a slice.
#pragma once
#include "kernels/weights/gauss_bands.h"

namespace h6::kernels {

inline constexpr int kGaussSweepStages = 3;
inline constexpr std::size_t kGaussSweepParts = 2;  // slices of the pairs of a product
// Boxes pay above this number of pairs a contact. A thousand contacts of `robust` on a plane take
// 0.65 times as long (the frame), 30,000 in a socket 0.69 (the weights); with boxes always, a
// thousand in a bore took 1.2 times as long.
inline constexpr std::uint64_t kGaussBoxes = 192;
// The tree is faster above this number of contacts, or of pairs per contact (one sphere, product).
inline constexpr std::size_t kGaussSweepMost = 32768;
inline constexpr std::uint64_t kGaussSweepPairs3 = 512, kGaussSweepPairs6 = 1536;

// The pairs of a product of two hats.
struct GaussPairs {
  const float* column[6];  // in the caller's order
  float width[2];
  float *at[6], *share;        // in order of the bands
  bool boxed;                  // whether blocks have boxes
  float *centre[6], *half[6];  // (blocks) of the boxes around the contacts of each block
  float *fresh[kGaussSweepParts], *sum[kGaussSweepParts];  // part by part
  std::size_t split[kGaussSweepParts + 1];                 // first block of each
};

struct GaussSweep {
  DirectionsView contacts;
  Hat hat;
  int densities;  // 2 for Hat::sum
  GaussBands bands[2];
  GaussPairs* product;   // of Hat::product
  float* per_share;      // 1 / the largest s
  std::uint64_t* pairs;  // (densities) pairs that the runs hold
  float* weight;
};

// Bytes of `memory`, any alignment.
std::size_t gauss_sweep_bytes(std::size_t count, Hat hat);

// Takes the arguments of gauss_weights_ref. weight (count).
GaussSweep gauss_sweep(const DirectionsView& c, Hat hat, const GaussWidths& widths, void* memory,
                       float* weight);
std::size_t gauss_sweep_slices(const GaussSweep& sweep, int stage);
void gauss_sweep_run(const GaussSweep& sweep, int stage, std::size_t slice);

// After stage 0: whether the pairs cost less than gauss_tree. The tree cannot do angles, because
// they are not quadratic.
inline bool gauss_sweep_pays(const GaussSweep& sweep) {
  if (sweep.bands[0].geodesic) return true;
  const std::uint64_t each = sweep.hat == Hat::product ? kGaussSweepPairs6 : kGaussSweepPairs3;
  std::uint64_t pairs = 0;
  for (int p = 0; p < sweep.densities; ++p) pairs += sweep.pairs[p];
  return pairs <= each * static_cast<std::uint64_t>(sweep.densities) * sweep.contacts.count;
}

// All stages on the caller's thread. The specification is gauss_weights_ref.
inline void gauss_weights_sweep(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                                void* memory, float* weight) {
  const GaussSweep sweep = gauss_sweep(c, hat, widths, memory, weight);
  for (int stage = 0; stage < kGaussSweepStages; ++stage)
    for (std::size_t i = 0; i < gauss_sweep_slices(sweep, stage); ++i)
      gauss_sweep_run(sweep, stage, i);
}

}  // namespace h6::kernels
