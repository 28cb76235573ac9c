// SPDX-License-Identifier: Apache-2.0
#include "io/field/view.h"

#include <algorithm>
#include <cmath>

#include "hapsix/vector.h"

namespace h6::io {

double trilinear(const float c[8], const double at[3], Vec3* gradient) {
  const double x = at[0], y = at[1], z = at[2];
  const double dx[4] = {double(c[1]) - c[0], double(c[3]) - c[2], double(c[5]) - c[4],
                        double(c[7]) - c[6]};
  const double v[4] = {c[0] + x * dx[0], c[2] + x * dx[1], c[4] + x * dx[2], c[6] + x * dx[3]};
  const double low = v[0] + y * (v[1] - v[0]), high = v[2] + y * (v[3] - v[2]);
  if (gradient) {
    gradient->x = (1 - z) * ((1 - y) * dx[0] + y * dx[1]) + z * ((1 - y) * dx[2] + y * dx[3]);
    gradient->y = (1 - z) * (v[1] - v[0]) + z * (v[3] - v[2]);
    gradient->z = high - low;
  }
  return low + z * (high - low);
}

bool FieldView::corners(const std::array<std::int32_t, 3>& cell, float out[8]) const {
  for (int k = 0; k < 3; ++k) {
    if (cell[k] < 0 || cell[k] + 1 >= 8 * field_.bricks[k]) return false;
  }
  const auto brick = [&](int x, int y, int z) {
    const std::size_t row =
        (std::size_t(z >> 3) * std::size_t(field_.bricks[1]) + std::size_t(y >> 3)) *
            std::size_t(field_.bricks[0]) +
        std::size_t(x >> 3);
    const std::int32_t index = field_.brick_index[row];
    return index < 0 ? nullptr : field_.samples.data() + std::size_t(index) * 512;
  };
  const auto node = [](int x, int y, int z) {
    return std::size_t(((z & 7) * 8 + (y & 7)) * 8 + (x & 7));
  };
  const int x = cell[0], y = cell[1], z = cell[2];
  const bool inside = (x & 7) != 7 && (y & 7) != 7 && (z & 7) != 7;
  const float* one = brick(x, y, z);
  if (!one) return false;
  for (int i = 0; i < 8; ++i) {
    const int nx = x + (i & 1), ny = y + (i >> 1 & 1), nz = z + (i >> 2);
    const float* from = inside ? one : brick(nx, ny, nz);
    if (!from) return false;
    out[i] = from[node(nx, ny, nz)];
  }
  return true;
}

const float* FieldView::finer(const std::array<std::int32_t, 3>& cell, int& factor) const {
  std::size_t brick = 0, local = 0;
  for (std::size_t k = 3; k-- > 0;) {
    brick = brick * std::size_t(field_.bricks[k]) + std::size_t(cell[k] >> 3);
    local = local * 8 + std::size_t(cell[k] & 7);
  }
  const std::int32_t row = field_.brick_index[brick];
  const std::int32_t refined = row < 0 ? -1 : field_.refined[std::size_t(row)];
  const std::int32_t i = refined < 0 ? 0 : field_.fine_index[512 * std::size_t(refined) + local];
  factor = i > 0 ? 2 : 4;
  if (i == 0) return nullptr;
  return i > 0 ? &field_.halves[27 * std::size_t(i - 1)]
               : &field_.quarters[125 * std::size_t(-1 - i)];
}

bool FieldView::distance(const Vec3& g, double& d, Vec3* gradient) const {
  const double place[3] = {g.x, g.y, g.z};
  std::array<std::int32_t, 3> cell{};
  double at[3];
  for (int k = 0; k < 3; ++k) {
    if (!(place[k] >= 0 && place[k] < 8.0 * field_.bricks[k])) return false;
    cell[k] = std::int32_t(place[k]);
    at[k] = place[k] - cell[k];
  }
  float corner[8];
  if (!corners(cell, corner)) return false;
  int factor = 1;
  if (const float* fine = field_.refined.empty() ? nullptr : finer(cell, factor)) {
    const int side = factor + 1;
    int low[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(int(at[k] * factor), factor - 1);
      at[k] = at[k] * factor - low[k];
    }
    for (int i = 0; i < 8; ++i)
      corner[i] =
          fine[((low[2] + (i >> 2)) * side + low[1] + (i >> 1 & 1)) * side + low[0] + (i & 1)];
  } else {
    factor = 1;
  }
  d = trilinear(corner, at, gradient) / field_.voxel_size;
  if (gradient) *gradient = (factor / field_.voxel_size) * *gradient;
  return true;
}

}  // namespace h6::io
