// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/forced/way_out.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/weights/series_solve.h"

namespace h6::cli {
namespace {

// The stiffness of the contacts. With a way out q the depth that is left is at most
// |q| sqrt(4 / kStiff); without one it does not shrink, however stiff the contacts are.
constexpr double kStiff = 1e8;

}  // namespace

// min 2 |y|^2 + kStiff/2 sum max(0, depth_i - J_i.y)^2, the solve of `series` with all but rigid
// contacts.
std::optional<double> way_out(const h6Contacts& c, double lever) {
  std::vector<double> column[8];
  double deepest = 0;
  for (std::size_t i = 0; i < c.count; ++i) {
    if (!(c.depth[i] > 0)) continue;
    const float row[7] = {c.nx[i], c.ny[i], c.nz[i], c.rx[i], c.ry[i], c.rz[i], c.depth[i]};
    for (int k = 0; k < 7; ++k) column[k].push_back(double{row[k]});
    column[7].push_back(kStiff);
    deepest = std::max(deepest, double{c.depth[i]});
  }
  const std::size_t count = column[0].size();
  if (count == 0) return 0;
  const kernels::SeriesColumnsT<double> contacts{
      column[0].data(), column[1].data(), column[2].data(),
      column[3].data(), column[4].data(), column[5].data(),
      column[6].data(), column[7].data(), count};
  std::vector<double> kappa(count), left(count);
  double y[6] = {};
  kernels::series_solve_ref(contacts, {4, lever, 1e-9, 200}, y, kappa.data(), left.data());
  const double length =
      std::sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3] + y[4] * y[4] + y[5] * y[5]);
  const double most = *std::max_element(left.begin(), left.end());
  if (most > 1e-2 * deepest || length > kFarthestOut * deepest) return std::nullopt;
  return length;
}

}  // namespace h6::cli
