// SPDX-License-Identifier: Apache-2.0
// lattice_hits_ref.cpp - the specification of lattice_hits: every line on its own, in integers.
#include "kernels/bake/lattice_hits.h"

namespace h6::kernels {

void lattice_hits_ref(const std::int32_t corner[3][3], const std::int32_t first[3],
                      const std::int32_t last[3], LatticeHits& hits) {
  const auto voxel = std::int64_t(kLatticeVoxel);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    hits.count[axis] = 0;
    hits.shift[axis] = lattice_shift(last[u] - first[u] + 1);
    // Twice the area of the triangle between the line through (j, k) and corners a and b.
    const auto twice_area = [&](int a, int b, std::int64_t j, std::int64_t k) {
      return std::int64_t(corner[b][u] - corner[a][u]) * (k - corner[a][v]) -
             std::int64_t(corner[b][v] - corner[a][v]) * (j - corner[a][u]);
    };
    const std::int64_t whole = twice_area(0, 1, corner[2][u], corner[2][v]);
    if (whole == 0) continue;
    const std::int64_t turn = whole > 0 ? 1 : -1;
    for (std::int64_t k = first[v]; k <= last[v]; ++k)
      for (std::int64_t j = first[u]; j <= last[u]; ++j) {
        std::int64_t share[3];
        for (int i = 0; i < 3; ++i)
          share[i] = turn * twice_area((i + 1) % 3, (i + 2) % 3, j * voxel, k * voxel);
        if (share[0] < 0 || share[1] < 0 || share[2] < 0) continue;
        const std::size_t slot =
            std::size_t(k - first[v]) << hits.shift[axis] | std::size_t(j - first[u]);
        hits.slot[axis][hits.count[axis]++] = std::uint32_t(slot);
        const double scale = 1 / kLatticeVoxel, by_area = scale / double(turn * whole);
        hits.at[axis][slot] =
            double(corner[0][axis]) * scale +
            (double(share[1]) * (double(corner[1][axis] - corner[0][axis]) * by_area) +
             double(share[2]) * (double(corner[2][axis] - corner[0][axis]) * by_area));
      }
  }
}

}  // namespace h6::kernels
