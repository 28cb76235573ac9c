// SPDX-License-Identifier: Apache-2.0
// view.h - samples a baked field at any place. Coordinates are in voxels: node (i, j, k) of the
// field is at (i, j, k).
#pragma once
#include <array>
#include <cstdint>

#include "io/field/field_data.h"

namespace h6::io {

class FieldView {
 public:
  explicit FieldView(const FieldData& field) : field_(field) {}

  Vec3 from_metres(const Vec3& p) const {
    const Vec3& o = field_.origin;
    const double h = field_.voxel_size;
    return {(p.x - o.x) / h, (p.y - o.y) / h, (p.z - o.z) / h};
  }
  Vec3 to_metres(const Vec3& g) const {
    const Vec3& o = field_.origin;
    const double h = field_.voxel_size;
    return {o.x + h * g.x, o.y + h * g.y, o.z + h * g.z};
  }

  // Trilinear [voxel]. False where a corner has no sample, far from the surface.
  bool distance(const Vec3& g, double& d, Vec3* gradient = nullptr) const;
  // The eight corners of a cell [m], x fastest, without finer samples; false where one has none.
  bool corners(const std::array<std::int32_t, 3>& cell, float out[8]) const;

 private:
  // The finer samples of a cell, and how many intervals they cut a voxel into; null: none.
  const float* finer(const std::array<std::int32_t, 3>& cell, int& factor) const;

  const FieldData& field_;
};

// The trilinear value, and gradient unless null, of eight corners at fractions of their cell, in
// the corners' unit.
double trilinear(const float corner[8], const double at[3], Vec3* gradient);

}  // namespace h6::io
