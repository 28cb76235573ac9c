// SPDX-License-Identifier: Apache-2.0
// cull_spheres.h - which spheres of a shell level may hold a contact.
//
// Xu & Barbic 2016, Sec. 3: a node is dropped when its signed distance exceeds its radius. The
// radius used here provably covers the error of interpolation too, so no contact is lost.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// By how much the distance at a sphere's centre can exceed the margin while a point inside the
// sphere, at most s voxels away, still samples within the margin:
//     reach(0) = 0
//     reach(s) = sqrt(3) s + r    for s < 1.6   interpolated distance is sqrt(3)-Lipschitz
//                s + sqrt(3) + r  otherwise     it is within sqrt(3)/2 of the true one, at each end
// r covers the rounding at both ends: int16 samples (2/2048) and float coordinates of fields up to
// 2048 voxels wide. The first form is valid when all cells on the way hold samples, which follows
// from a band of at least 3 voxels and a margin of at most 0.5. Otherwise set `wide`: the second
// form then serves every s > 0.
inline constexpr float kSqrt3 = 1.7320508f;
inline constexpr float kReachRounding = 0.003f;
inline constexpr float kShortReach = 1.6f;
inline constexpr float cull_reach(float s, bool wide) {
  if (!(s > 0.0f)) return 0.0f;
  return (s < kShortReach && !wide ? kSqrt3 * s : s + kSqrt3) + kReachRounding;
}

// The distance that a point which samples `distance` can certainly move without touching: the
// inverse of cull_reach. Negative when the point may touch already. It grows by no more than
// `distance` does, so a point stays outside of a margin m for cull_clearance(distance) - m.
inline constexpr float cull_clearance(float distance, bool wide) {
  const float d = distance - kReachRounding;
  const float long_form = d - kSqrt3;
  if (wide) return long_form;
  const float short_form = d * (1.0f / kSqrt3);
  return short_form < kShortReach  ? short_form
         : long_form > kShortReach ? long_form
                                   : kShortReach - 1e-4f;
}

// Writes to `survivors` (room for `count`; may be `rows` itself) every row r among rows[0..count-1]
// (or first..first+count-1 when rows is null), in that order, with
//     distance(r) <= cull_reach(radius[r] * radius_scale, wide) + margin        [voxels]
// with the distance of sample_field. Returns the number of survivors; rows past them are
// unspecified. When `clearance` (room for `count`) is not null, entry k is how far the shell may
// move in the field's frame before a point of sphere rows[k] may touch:
// cull_clearance(distance) - radius, but at most 0 for survivors.
std::size_t cull_spheres(const FieldView& field, const Affine& to_field, const SpheresView& spheres,
                         float radius_scale, bool wide, float margin, const std::uint32_t* rows,
                         std::uint32_t first, std::size_t count, std::uint32_t* survivors,
                         float* clearance);
std::size_t cull_spheres_ref(const FieldView& field, const Affine& to_field,
                             const SpheresView& spheres, float radius_scale, bool wide,
                             float margin, const std::uint32_t* rows, std::uint32_t first,
                             std::size_t count, std::uint32_t* survivors, float* clearance);

}  // namespace h6::kernels
