// SPDX-License-Identifier: Apache-2.0
// smooth_depths.h - depths and gradients without the error of trilinear interpolation.
#pragma once
#include "kernels/contact/contact_columns.h"

namespace h6::kernels {

// Between samples a curved surface lies beside the trilinear one: METHOD.md, Sec. 3, "Firm".
// Crosses have steps of one voxel. With t the place of a contact in its cell on an axis, f the
// second difference over its cross on that axis and s the central one,
//     sure   = clamp(2 room, 0, 1), room from the distance to band - 1, from the place to the
//     grid's
//              first or last node less 1
//     even   = sure max(0, 1 - (sum |f| / kSmoothTo)^2)
//     depth += voxel even sum(t (1 - t) f / 2) clamp(depth / (kSmoothFrom voxel), 0, 1)
//     e      = even min(|s|^2, 1)
//     g      = (1 - e) g + e s, made unit
// s does without t: where a contact lies on a node, g may be from the cell beside its t. A field
// that is no distance can have s = 0. `to_field` maps the points to the field; depth and `voxel`
// [m]; (gx, gy, gz) is a unit vector.
inline constexpr float kSmoothTo = 0.5f;    // a sharper field stays as it is [1/voxel]
inline constexpr float kSmoothFrom = 0.1f;  // from this depth on the whole error is taken [voxel]
void smooth_depths(const Crosses& crosses, const Affine& to_field, const PointsView& points,
                   float voxel, float* depth, float* gx, float* gy, float* gz);
void smooth_depths_ref(const Crosses& crosses, const Affine& to_field, const PointsView& points,
                       float voxel, float* depth, float* gx, float* gy, float* gz);

}  // namespace h6::kernels
