// SPDX-License-Identifier: Apache-2.0
// field_layout.h - from the plain arrays of h6FieldDef to the hot layout of FieldView.
//
// Kept beside the kernels so that the layout is known in one place: change it here and in
// sample_field, nowhere else. Each call converts one brick; the engine calls it from many threads.
#pragma once
#include "hapsix/types.h"
#include "kernels/views.h"

namespace h6::kernels {

// Bricks and far cells that a definition needs, so that storage can be reserved. More than
// kMaxBricks cannot be addressed by the kernels: refuse such a field.
struct FieldLayoutSize {
  std::size_t bricks;
  std::size_t far_cells;
};
FieldLayoutSize field_layout_size(const h6FieldDef& def);

// FieldView::band: less than the definition's by what float rounds.
float layout_band(const h6FieldDef& def);

// Fills table (one entry a brick): rows in order of the table for both kinds.
void layout_table(const h6FieldDef& def, std::int32_t* table);

// Packs the brick or far cell behind table entry `cell`. Nodes of the apron that no brick holds get
// sign * max(band, far bound): they belong to cells wholly outside the band. Distances beyond the
// int16 range are clamped to it.
void layout_cell(const h6FieldDef& def, const std::int32_t* table, std::size_t cell,
                 std::int16_t* bricks, std::int16_t* far);

}  // namespace h6::kernels
