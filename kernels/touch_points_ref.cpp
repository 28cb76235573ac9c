// touch_points_ref.cpp - the specification of touch_points.h.
#include <algorithm>
#include <cmath>

#include "kernels/cull_spheres.h"
#include "kernels/sample_field.h"
#include "kernels/touch_points.h"

namespace h6::kernels {

std::size_t touch_points_ref(const FieldView& field, const Affine& to_field,
                             const PointsView& points, const std::uint32_t* rows, std::size_t count,
                             float limit, bool, const Touching& out, float* distance) {
  std::size_t written = 0;
  for (std::size_t i = 0; i < count; ++i) {
    float gx, gy, gz;
    sample_field_ref(field, to_field, points, rows + i, 1, distance + i, &gx, &gy, &gz);
    if (!(distance[i] < limit)) continue;
    out.row[written] = rows[i];
    out.distance[written] = distance[i];
    out.gx[written] = gx, out.gy[written] = gy, out.gz[written] = gz;
    ++written;
  }
  return written;
}

void note_expiry_ref(const std::uint32_t* rows, const float* distance, std::size_t count,
                     float margin, bool wide, float now, float slack, float* expiry) {
  for (std::size_t i = 0; i < count; ++i)
    expiry[rows[i]] = now + std::max(cull_clearance(distance[i] - margin, wide) - slack, 0.0f);
}

void make_contacts_ref(const ShellColumns& shell, const Touching& rows, std::size_t count,
                       const ContactFrame& frame, const MadeContacts& out) {
  const auto rotate = [](const float R[9], float x, float y, float z, float v[3]) {
    for (int k = 0; k < 3; ++k) v[k] = R[3 * k] * x + R[3 * k + 1] * y + R[3 * k + 2] * z;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t row = rows.row[i];
    float n[3], g[3], r[3];
    rotate(frame.Ra, shell.nx[row], shell.ny[row], shell.nz[row], n);
    rotate(frame.Ra, shell.x[row], shell.y[row], shell.z[row], r);
    rotate(frame.Rb, rows.gx[i], rows.gy[i], rows.gz[i], g);
    const float length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    for (int k = 0; k < 3; ++k) g[k] = length > 1e-6f ? g[k] / length : n[k];
    out.depth[i] = -rows.distance[i] * frame.voxel;
    out.nx[i] = n[0], out.ny[i] = n[1], out.nz[i] = n[2];
    out.gx[i] = g[0], out.gy[i] = g[1], out.gz[i] = g[2];
    out.rx[i] = r[0] + frame.arm[0], out.ry[i] = r[1] + frame.arm[1];
    out.rz[i] = r[2] + frame.arm[2];
    out.point[i] = shell.point[row];
  }
}

}  // namespace h6::kernels
