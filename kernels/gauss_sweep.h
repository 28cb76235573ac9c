// gauss_sweep.h - the weights of gauss_weights.h for some thousand contacts: sorted, so that each
// meets only those of a window.
//
// Hats over one sphere: gauss_bands.h. A product of two: contacts are sorted by their place along a
// fixed line across the map of N. A hat reaches no farther along the line than it does on the map,
// so a contact meets only those of a window; and since a hat is the same both ways, only those
// behind it: one evaluation serves both densities.
//
//     columns -> buckets along the line -> rows in order, with the end of every window
//             -> sums of a row (over lanes) and of a column (over rows) -> weights
//
// Stages and slices are those of gauss_tree.h. Slices have their own sums, which are added in
// order, so which thread runs what changes no bit.
#pragma once
#include "kernels/gauss_bands.h"

namespace h6::kernels {

inline constexpr int kGaussSweepStages = 3;
inline constexpr std::size_t kGaussSweepParts = 2;     // slices of a product's pairs
inline constexpr std::size_t kGaussSweepMost = 32768;  // contacts; from there on gauss_tree
inline constexpr std::uint64_t kGaussSweepPairs3 = 512, kGaussSweepPairs6 = 1536;  // a contact

// The density of the product of two hats.
struct GaussLine {
  const float* column[6];  // as they came
  float width[2];
  // In order along the line, padded to whole tiles.
  float *at[6], *share;
  float* row;                                              // sums of rows
  float *fresh[kGaussSweepParts], *sum[kGaussSweepParts];  // of columns, part by part
  std::uint32_t* place;                                    // (count) where each contact went
  std::uint32_t* end;                                      // of each row group's window
  std::size_t* split;                                      // first row of each part
};

struct GaussSweep {
  DirectionsView contacts;
  Hat hat;
  int densities;         // 2 for Hat::sum
  GaussBands bands[2];   // of hats over one sphere
  GaussLine line;        // of a product
  float* per_share;      // 1 / the largest s
  std::uint64_t* pairs;  // (densities) that windows hold
  float* weight;
};

// Bytes of `memory`, any alignment.
std::size_t gauss_sweep_bytes(std::size_t count, Hat hat);

// Arguments as of gauss_weights, geodesic excepted. weight (count).
GaussSweep gauss_sweep(const DirectionsView& c, Hat hat, const GaussWidths& widths, void* memory,
                       float* weight);
std::size_t gauss_sweep_slices(const GaussSweep& sweep, int stage);
void gauss_sweep_run(const GaussSweep& sweep, int stage, std::size_t slice);

// After stage 0: whether its pairs cost less than gauss_tree does.
inline bool gauss_sweep_pays(const GaussSweep& sweep) {
  const std::uint64_t each = sweep.hat == Hat::product ? kGaussSweepPairs6 : kGaussSweepPairs3;
  std::uint64_t pairs = 0;
  for (int p = 0; p < sweep.densities; ++p) pairs += sweep.pairs[p];
  return pairs <= each * static_cast<std::uint64_t>(sweep.densities) * sweep.contacts.count;
}

// All of it, on the caller. The specification is gauss_weights_ref.
inline void gauss_weights_sweep(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                                void* memory, float* weight) {
  const GaussSweep sweep = gauss_sweep(c, hat, widths, memory, weight);
  for (int stage = 0; stage < kGaussSweepStages; ++stage)
    for (std::size_t i = 0; i < gauss_sweep_slices(sweep, stage); ++i)
      gauss_sweep_run(sweep, stage, i);
}

}  // namespace h6::kernels
