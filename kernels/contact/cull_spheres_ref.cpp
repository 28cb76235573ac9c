// SPDX-License-Identifier: Apache-2.0
// cull_spheres_ref.cpp - the specification of cull_spheres, one sphere at a time.
#include "kernels/contact/cull_spheres.h"
#include "kernels/field/sample_field.h"

namespace h6::kernels {

std::size_t cull_spheres_ref(const FieldView& field, const Affine& to_field,
                             const SpheresView& spheres, float radius_scale, const Reach& reach,
                             float margin, const std::uint32_t* rows, std::uint32_t first,
                             std::size_t count, std::uint32_t* survivors, float* clearance, bool) {
  const PointsView centres{spheres.x, spheres.y, spheres.z, spheres.count};
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t row = rows != nullptr ? rows[k] : first + static_cast<std::uint32_t>(k);
    float distance;
    sample_field_ref(field, to_field, centres, &row, 1, &distance, nullptr, nullptr, nullptr);
    // Xu & Barbic 2016, Sec. 3, with the error of interpolation.
    const float radius = spheres.radius[row] * radius_scale;
    const bool keep = distance <= cull_reach(radius, reach) + margin;
    if (clearance != nullptr) {
      const float left = cull_clearance(distance, reach) - radius;
      clearance[k] = keep && left > 0 ? 0.0f : left;
    }
    if (keep) survivors[written++] = row;
  }
  return written;
}

}  // namespace h6::kernels
