// SPDX-License-Identifier: Apache-2.0
// field_layout.h - from the plain arrays of h6FieldDef to the hot layout of FieldView.
//
// The layout is known here and in sample_field, nowhere else. Each call converts one row
// of bricks; the engine calls it from many threads.
#pragma once
#include "hapsix/types.h"
#include "kernels/views.h"

namespace h6::kernels {

// The numbers of bricks and far cells of a definition, to reserve storage. The kernels cannot
// address more than kMaxBricks: refuse such a field.
struct FieldLayoutSize {
  std::size_t bricks;
  std::size_t far_cells;
  std::size_t refined;     // bricks with finer samples
  std::size_t fine_units;  // of kFineUnit int16
  // The size of the table and all pools.
  std::size_t bytes() const {
    return 4 * (bricks + far_cells) + 2 * (kBrickStride * bricks + 8 * far_cells +
                                           kCutStride * refined + kFineUnit * fine_units);
  }
};
FieldLayoutSize field_layout_size(const h6FieldDef& def);

// FieldView::band: the band of the definition, reduced by the rounding of float.
float layout_band(const h6FieldDef& def);

// Fills table (one entry a brick): rows in order of the table, those of refined bricks first.
void layout_table(const h6FieldDef& def, std::int32_t* table);
// Fills cuts (refined x kCutStride): where the finer samples of each cell lie.
void layout_cuts(const h6FieldDef& def, const std::int32_t* table, std::uint16_t* cuts);

// Packs the bricks and far cells of a row along x; row counts 0 .. bricks[1] * bricks[2] - 1. Nodes
// of the apron that no brick holds belong to cells wholly outside the band; they get
// sign * max(band, far bound). Distances are clamped to the range of int16. bricks may be null: then
// only far cells are packed.
void layout_row(const h6FieldDef& def, const std::int32_t* table, std::size_t row,
                std::int16_t* bricks, std::int16_t* far);
// Packs the finer samples of table entry `cell`, if it has any, to their place in `fine`.
void layout_fine(const h6FieldDef& def, const std::int32_t* table, const std::uint16_t* cuts,
                 std::size_t cell, std::int16_t* fine);

}  // namespace h6::kernels
