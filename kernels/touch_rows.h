// touch_rows.h - which of some points of a shell touch a field, and when the others may.
#pragma once
#include "kernels/touch_groups.h"
#include "kernels/views.h"

namespace h6::kernels {

// A shell's points one after the other, x y z each; 4 more bytes are readable.
struct PlacesView {
  const float* xyz;
};

// What of a point's clearance takes up the rounding of the way and of both to float. [voxel]
inline constexpr float kExpirySlack = 1e-3f;

// Samples points rows[0..count-1] (each at most once), writes those with a distance below `limit`,
// in order, and returns how many. `out` has room for `count` rounded up to 16 rows; out.row may be
// `rows` itself. expiry[r] of every such row r becomes, in quanta of 1/256 voxel rounded down and
// at most 65535, `now` plus how far the shell may move before the point can come below the limit
// (cull_clearance, of cull_spheres.h, less kExpirySlack, at least 0).
std::size_t touch_rows(const FieldView& field, const Affine& to_field, const PlacesView& places,
                       const std::uint32_t* rows, std::size_t count, float limit, bool wide,
                       float now, const Touching& out, std::uint16_t* expiry);
std::size_t touch_rows_ref(const FieldView& field, const Affine& to_field, const PlacesView& places,
                           const std::uint32_t* rows, std::size_t count, float limit, bool wide,
                           float now, const Touching& out, std::uint16_t* expiry);

}  // namespace h6::kernels
