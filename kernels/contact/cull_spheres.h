// SPDX-License-Identifier: Apache-2.0
// cull_spheres.h - which spheres of a shell level may hold a contact.
//
// Xu & Barbic 2016, Sec. 3: a node is dropped when its signed distance exceeds its radius. The
// radius used here provably covers the error of interpolation too, so no contact is lost.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

inline constexpr float kSqrt3 = 1.7320508f;
inline constexpr float kReachRounding = 0.003f;

// By how much the distance at a sphere's centre can exceed the margin while a point inside the
// sphere, at most s voxels away, still samples within the margin:
//     reach(0) = 0
//     reach(s) = slope s + r    for s < below   interpolated distance is slope-Lipschitz
//                s + error + r  otherwise       it is within error/2 of the true one, at each end
// r covers the rounding at both ends: int16 samples (2/2048) and float coordinates of fields up to
// 2048 voxels wide. The first form is valid when all cells on the way hold samples. A point within
// the margin is at most margin + error/2 from the surface, so with a band of at least 3 voxels and
// a margin of at most 0.5 a way of 2.5 - error/2 stays in the band. Otherwise use wide_reach: the
// second form then serves every s > 0.
//
// Where nothing is refined, all nodes are true distances. Then slope is sqrt(3), and error is
// sqrt(3): a point's mean distance from a cell's corners, by their weights, is at most sqrt(3)/2.
//
// In refined fields, nodes on a face towards a coarser cell are interpolated, with an error of
// their own: sqrt(2)/2 on a coarse face, sqrt(2)/4 more on a face of halves. Inside a cell of
// quarters sqrt(3)/8 is added; a cell of halves has no second face and adds sqrt(3)/4. So error/2
// is at most sqrt(2)/2 + sqrt(2)/4 + sqrt(3)/8 = 1.2772. The slope is measured when a model is
// made.
struct Reach {
  float slope = kSqrt3;  // voxels per voxel
  float error = kSqrt3;  // at both ends together [voxel]
  float below = 1.6f;    // [voxel]; 0: the second form always
};
inline constexpr Reach refined_reach(float steepest) {
  return {steepest > kSqrt3 ? steepest : kSqrt3, 2.5545f, 1.2f};
}
inline constexpr Reach wide_reach(const Reach& r) { return {r.slope, r.error, 0.0f}; }

inline constexpr float cull_reach(float s, const Reach& r) {
  if (!(s > 0.0f)) return 0.0f;
  return (s < r.below ? r.slope * s : s + r.error) + kReachRounding;
}

// The distance that a point which samples `distance` can certainly move without touching: the
// inverse of cull_reach. Negative when the point may touch already. It grows by no more than
// `distance` does, so a point stays outside of a margin m for cull_clearance(distance) - m.
inline constexpr float cull_clearance(float distance, const Reach& r) {
  const float d = distance - kReachRounding;
  const float long_form = d - r.error;
  if (!(r.below > 0)) return long_form;
  const float short_form = d * (1.0f / r.slope);
  return short_form < r.below ? short_form : long_form > r.below ? long_form : r.below - 1e-4f;
}

// Writes to `survivors` (room for `count`; may be `rows` itself) every row r among rows[0..count-1]
// (or first..first+count-1 when rows is null), in that order, with
//     distance(r) <= cull_reach(radius[r] * radius_scale, reach) + margin        [voxels]
// with the distance of sample_field. Returns the number of survivors; rows past them are
// unspecified. When `clearance` (room for `count`) is not null, entry k is how far the shell may
// move in the field's frame before a point of sphere rows[k] may touch:
// cull_clearance(distance) - radius, but at most 0 for survivors. `cold`: the field is not in the
// caches, so memory is prefetched for few spheres, too; the result is the same.
std::size_t cull_spheres(const FieldView& field, const Affine& to_field, const SpheresView& spheres,
                         float radius_scale, const Reach& reach, float margin,
                         const std::uint32_t* rows, std::uint32_t first, std::size_t count,
                         std::uint32_t* survivors, float* clearance, bool cold = true);
std::size_t cull_spheres_ref(const FieldView& field, const Affine& to_field,
                             const SpheresView& spheres, float radius_scale, const Reach& reach,
                             float margin, const std::uint32_t* rows, std::uint32_t first,
                             std::size_t count, std::uint32_t* survivors, float* clearance,
                             bool cold = true);

}  // namespace h6::kernels
