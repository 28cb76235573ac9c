// cull_spheres.h - which spheres of a shell level may hold a contact.
//
// Xu & Barbic 2016, Sec. 3: a node is dropped when its signed distance exceeds its radius. Here
// with a radius that provably also covers what interpolation adds: no contact is lost.
#pragma once
#include "kernels/views.h"

namespace h6::kernels {

// How much larger than the margin the distance at a sphere's centre can be while a point inside the
// sphere, s voxels away at most, still samples within the margin:
//     reach(0) = 0
//     reach(s) = sqrt(3) s + r    for s < 1.6   interpolated distance is sqrt(3)-Lipschitz
//                s + sqrt(3) + r  otherwise     it is within sqrt(3)/2 of the true one, at each end
// r covers what rounding adds at both ends: int16 samples (2/2048) and float coordinates of fields
// up to 2048 voxels wide. The short form needs all cells on the way to hold samples, which follows
// where the field's band is at least 3 voxels and the margin at most 0.5; else set `wide`, and the
// long form serves every s > 0.
inline constexpr float kSqrt3 = 1.7320508f;
inline constexpr float kReachRounding = 0.003f;
inline constexpr float kShortReach = 1.6f;
inline constexpr float cull_reach(float s, bool wide) {
  if (!(s > 0.0f)) return 0.0f;
  return (s < kShortReach && !wide ? kSqrt3 * s : s + kSqrt3) + kReachRounding;
}

// Writes to `survivors` (room for `count`; may be `rows` itself) every row r among rows[0..count-1]
// (or first..first+count-1 when rows is null), in that order, with
//     distance(r) <= cull_reach(radius[r] * radius_scale, wide) + margin        [voxels]
// distance as sample_field says. Returns how many were written. When `distances` (room for
// `count`) is not null it gets the distance of each survivor. Rows past the survivors hold nothing
// of use.
std::size_t cull_spheres(const FieldView& field, const Affine& to_field, const SpheresView& spheres,
                         float radius_scale, bool wide, float margin, const std::uint32_t* rows,
                         std::uint32_t first, std::size_t count, std::uint32_t* survivors,
                         float* distances);
std::size_t cull_spheres_ref(const FieldView& field, const Affine& to_field,
                             const SpheresView& spheres, float radius_scale, bool wide,
                             float margin, const std::uint32_t* rows, std::uint32_t first,
                             std::size_t count, std::uint32_t* survivors, float* distances);

}  // namespace h6::kernels
