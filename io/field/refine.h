// SPDX-License-Identifier: Apache-2.0
// refine.h - one field from two fields of a mesh that share nodes: coarse bricks, and finer samples
// in the cells where the coarse ones would miss a tolerance.
#pragma once
#include "io/field/field_data.h"

namespace h6::io {

inline constexpr int kCut = 4;  // fine voxels along a coarse one

// Both fields begin at the same node, cover the same box and have the same offset. The signs are
// those of the fine one, whose far grid need hold no more; the far bounds are the coarse one's.
// Within the fine band, cells keep the coarse samples where these are right to the tolerance [m] at
// the fine nodes; else they get two or four samples a voxel. Beyond, they keep the coarse samples.
// The result is continuous.
FieldData refine(const FieldData& coarse, const FieldData& fine, double tolerance,
                 unsigned threads);

}  // namespace h6::io
