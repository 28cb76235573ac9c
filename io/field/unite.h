// SPDX-License-Identifier: Apache-2.0
// unite.h - two obstacles as one.
#pragma once
#include "io/field/field_data.h"

namespace h6::io {

// The least of two distances, node by node. Both fields have the same nodes, band and far grid, and
// no finer samples. Where one has no samples, its bound stands for them. Bricks take the part and
// the triangle of the nearer surface; all else is that of `a`.
FieldData unite(FieldData a, const FieldData& b, unsigned threads);

}  // namespace h6::io
