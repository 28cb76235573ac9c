// SPDX-License-Identifier: Apache-2.0
// conform.h - makes the finer samples of cells continuous with the coarser ones beside them.
#pragma once
#include "io/field/field_data.h"

namespace h6::io {

// In field.halves and field.quarters, a node on a face, edge or corner towards a coarser cell takes
// that cell's interpolation. Halves and quarters must have the same values at nodes that they
// share.
void conform(unsigned threads, FieldData& field);

}  // namespace h6::io
