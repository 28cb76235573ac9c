// SPDX-License-Identifier: Apache-2.0
// gauss_bands.h - contacts in bands over one sphere, for gauss_sweep.h: who meets whom, and the
// density of one hat over it.
//
// Contacts are sorted by band across a fixed line, as wide as a hat reaches, and by cell along it,
// back and forth. What a contact meets then lies in a few runs: of its own band and of those next
// to it. Sixteen contacts in a row, a lane each, sum the hats of everything in their runs: no sum
// is shared, so any split gives the same bits. Contacts that follow each other with the same
// direction, as on a flat wall, go through all of it as one.
//
// Of the product of two hats only the order over the first sphere comes from here, and runs.
#pragma once
#include "kernels/weights/gauss_memory.h"
#include "kernels/weights/gauss_weights.h"

namespace h6::kernels {

inline constexpr std::size_t kBandBlock = 16;
// Cells that n contacts are sorted into, at most.
inline std::uint32_t band_cells(std::size_t n) {
  std::uint32_t cells = 256;
  while (cells < 16384 && cells < 2 * n) cells *= 2;
  return cells;
}

// Contacts that a block meets, itself among them: places in order and apart.
struct BandRuns {
  std::uint32_t first[4], end[4], count;
};

struct GaussBands {
  const float* column[3];  // as they came
  float width;
  bool geodesic;               // as of GaussWidths
  bool order_only;             // only the order is wanted, no sums
  float *direction[3], *mass;  // of those that are one: the s_j over the largest s added up
  std::uint32_t* head;         // the first contact of each
  // In order of the bands, padded to whole blocks with copies of the last one that weigh nothing.
  float* at;               // x y z and mass, one by one
  float* phi;              // what is summed
  std::uint32_t* place;    // (count) where each contact went
  std::uint32_t* rank;     // of each in its cell
  std::uint32_t* start;    // first of each cell, and the count
  std::uint32_t* cell_at;  // the cell of what is at a place
  std::uint32_t* source;   // (order_only) what is at a place, padded with 0
  BandRuns* runs;          // of each block; order_only: from itself on, whole vectors
  struct Grid {
    std::uint32_t count;                // of what is sorted
    std::uint32_t bands, cells, shift;  // cells of a band: 2^shift
    std::uint32_t reach;                // cells that a hat spans
  } * grid;
};

void lay_out_bands(GaussBands& g, std::size_t count, GaussColumns& columns);
// Sorts; returns how many pairs the runs hold.
std::uint64_t sort_bands(const GaussBands& g, const DirectionsView& c, float per_share);
inline std::size_t band_blocks(std::size_t count) { return (count + kBandBlock - 1) / kBandBlock; }
// Fills phi of blocks begin .. end - 1; there may be fewer.
void sum_bands(const GaussBands& g, std::size_t begin, std::size_t end);

}  // namespace h6::kernels
