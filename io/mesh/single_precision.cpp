// SPDX-License-Identifier: Apache-2.0
#include "io/mesh/single_precision.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace h6::io {

std::string too_far_for_floats(const Vec3& low, const Vec3& high) {
  const double far = std::max({std::abs(low.x), std::abs(low.y), std::abs(low.z), std::abs(high.x),
                               std::abs(high.y), std::abs(high.z)});
  const double side = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  if (!(far > 0) || !std::isfinite(far)) return "";
  const double step = std::ldexp(1.0, std::ilogb(far) - 23);  // to the next float
  if (step <= 2e-4 * side) return "";
  char text[240];
  std::snprintf(text, sizeof text,
                "the mesh lies %.4g m from its origin, where numbers of single precision (of an "
                "STL file, of a shell) are %.3g mm apart; move it nearer to its origin",
                far, 1e3 * step);
  return text;
}

std::string too_far_for_floats(const Mesh& mesh) {
  if (mesh.vertices.empty()) return "";
  const MeshBounds box = bounds_of(mesh);
  return too_far_for_floats(box.low, box.high);
}

}  // namespace h6::io
