// SPDX-License-Identifier: Apache-2.0
// touch_groups_ref.cpp - the specification of touch_groups and make_contacts.
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/contact/touch_groups.h"
#include "kernels/field/sample_field.h"

namespace h6::kernels {
namespace {

// In float like affine_row of sample_field-inl.h, so that both find the same cell.
bool in_brick(const FieldView& field, const Affine& to_field, const PointsView& points,
              std::uint32_t row) {
  std::int32_t brick[3];
  for (int k = 0; k < 3; ++k) {
    const float* m = to_field.m[k];
    const float q = std::fma(m[0], points.x[row],
                             std::fma(m[1], points.y[row], std::fma(m[2], points.z[row], m[3])));
    if (!(q >= 0 && q <= static_cast<float>(8 * field.size[k] - 1))) return false;
    brick[k] = std::min(static_cast<std::int32_t>(q), 8 * field.size[k] - 2) / 8;
  }
  return field.table[(brick[2] * field.size[1] + brick[1]) * field.size[0] + brick[0]] >= 0;
}

}  // namespace

std::size_t touch_groups_ref(const FieldView& field, const Affine& to_field,
                             const PointsView& points, const std::uint32_t* groups,
                             std::size_t count, float limit, bool, const GroupLook& look,
                             const Touching& out) {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const unsigned rows = look.rows ? look.rows[k] : kAllRows;
    float distance[kGroup], least = kNone;
    const float here = look.reach ? look.reach[groups[k]] : limit;
    for (std::size_t i = 0; i < kGroup; ++i) {
      distance[i] = kNone;
      const auto row = static_cast<std::uint32_t>(kGroup * groups[k] + i);
      if (row >= points.count || !(rows >> i & 1u)) continue;
      float gx, gy, gz;
      sample_field_ref(field, to_field, points, &row, 1, &distance[i], &gx, &gy, &gz);
      least = std::min(least, distance[i]);
      const bool sampled = here > 0 && in_brick(field, to_field, points, row);
      if (!(distance[i] < (sampled ? here : 0))) continue;
      out.row[written] = row;
      out.distance[written] = distance[i];
      out.gx[written] = gx, out.gy[written] = gy, out.gz[written] = gz;
      ++written;
    }
    look.least[k] = least;
    if (!look.rows || rows != kAllRows) continue;
    look.near_rows[k] = 0;
    look.rest[k] = kNone;
    for (std::size_t i = 0; i < kGroup; ++i)
      if (distance[i] < std::max(look.near, kNearLeast * least))
        look.near_rows[k] = static_cast<std::uint16_t>(look.near_rows[k] | 1u << i);
      else
        look.rest[k] = std::min(look.rest[k], distance[i]);
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
