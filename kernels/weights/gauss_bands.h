// SPDX-License-Identifier: Apache-2.0
// gauss_bands.h - sorts contacts into bands over one sphere, for gauss_sweep.h, and sums the
// density of one hat over it.
//
// Bands lie across a fixed line and are as wide as a hat reaches. Within a band contacts are sorted
// by cell, in alternating direction from band to band. The neighbours of a contact then lie in a
// few runs: of its own band and of the two next to it. Sixteen contacts in a row, a lane each, sum
// the hats of everything in their runs. No sum is shared, so any split gives the same bits.
// Consecutive contacts of the same direction, as on a flat wall, are merged into one item.
//
// For the product of two hats only the order over the first sphere and the runs come from here.
#pragma once
#include "kernels/weights/gauss_memory.h"
#include "kernels/weights/gauss_weights.h"

namespace h6::kernels {

inline constexpr std::size_t kBandBlock = 16;
// The most cells that n contacts are sorted into.
inline std::uint32_t band_cells(std::size_t n) {
  std::uint32_t cells = 256;
  while (cells < 16384 && cells < 2 * n) cells *= 2;
  return cells;
}

// The runs of items within reach of a block, itself included: in order, without overlap.
struct BandRuns {
  std::uint32_t first[4], end[4], count;
};

struct GaussBands {
  const float* column[3];  // in the caller's order
  float width;
  bool geodesic;               // as of GaussWidths
  bool order_only;             // only the order is wanted, no sums
  float *direction[3], *mass;  // of merged items; mass: sum of s_j / largest s
  std::uint32_t* head;         // first contact of each merged item
  // In order of the bands, padded to whole blocks with copies of the last item of mass 0.
  float* at;               // x y z mass, item by item
  float* phi;              // density of each item
  std::uint32_t* place;    // (count) where each contact went
  std::uint32_t* rank;     // rank of each item in its cell
  std::uint32_t* start;    // first place of each cell, then the count
  std::uint32_t* cell_at;  // cell of the item at a place
  std::uint32_t* source;   // (order_only) contact at a place, padded with 0
  BandRuns* runs;          // of each block; order_only: from the block itself on, in whole vectors
  struct Grid {
    std::uint32_t count;                // items that are sorted
    std::uint32_t bands, cells, shift;  // cells of a band: 2^shift
    std::uint32_t reach;                // cells that a hat spans
  } * grid;
};

void lay_out_bands(GaussBands& g, std::size_t count, GaussColumns& columns);
// Sorts; returns how many pairs the runs hold.
std::uint64_t sort_bands(const GaussBands& g, const DirectionsView& c, float per_share);
inline std::size_t band_blocks(std::size_t count) { return (count + kBandBlock - 1) / kBandBlock; }
// Fills phi of blocks begin .. end - 1, as far as they exist.
void sum_bands(const GaussBands& g, std::size_t begin, std::size_t end);

}  // namespace h6::kernels
