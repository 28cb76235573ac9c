// touch_groups_ref.cpp - the specification of touch_groups and make_contacts.
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/sample_field.h"
#include "kernels/touch_groups.h"

namespace h6::kernels {

std::size_t touch_groups_ref(const FieldView& field, const Affine& to_field,
                             const PointsView& points, const std::uint32_t* groups,
                             std::size_t count, float limit, bool, const Touching& out,
                             float* least) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    least[k] = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < kGroup; ++i) {
      const auto row = static_cast<std::uint32_t>(kGroup * groups[k] + i);
      if (row >= points.count) continue;
      float d, gx, gy, gz;
      sample_field_ref(field, to_field, points, &row, 1, &d, &gx, &gy, &gz);
      least[k] = std::min(least[k], d);
      if (!(d < limit)) continue;
      out.row[written] = row;
      out.distance[written] = d;
      out.gx[written] = gx, out.gy[written] = gy, out.gz[written] = gz;
      ++written;
    }
  }
  return written;
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
