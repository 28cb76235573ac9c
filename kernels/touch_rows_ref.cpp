// touch_rows_ref.cpp - the specification of touch_rows, one point at a time.
#include "kernels/touch_rows.h"

#include <algorithm>

#include "kernels/cull_spheres.h"
#include "kernels/expiry.h"
#include "kernels/sample_field.h"

namespace h6::kernels {

std::size_t touch_rows_ref(const FieldView& field, const Affine& to_field, const PlacesView& places,
                           const std::uint32_t* rows, std::size_t count, float limit, bool wide,
                           float now, const Touching& out, std::uint16_t* expiry) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint32_t row = rows[k];
    const float* p = places.xyz + std::size_t{3} * row;
    float d, gx, gy, gz;
    sample_field_ref(field, to_field, {p, p + 1, p + 2, 1}, nullptr, 1, &d, &gx, &gy, &gz);
    const float clear = std::max(cull_clearance(d - limit, wide) - kExpirySlack, 0.0f);
    expiry[row] =
        static_cast<std::uint16_t>(std::min((now + clear) / kPointQuantum, kNeverExpires));
    if (!(d < limit)) continue;
    out.row[written] = row;
    out.distance[written] = d;
    out.gx[written] = gx, out.gy[written] = gy, out.gz[written] = gz;
    ++written;
  }
  return written;
}

}  // namespace h6::kernels
