// SPDX-License-Identifier: Apache-2.0
// nearest_eight_ref.cpp - the specification of nearest_eight.cpp: exact distances in double.
#include <algorithm>
#include <cmath>

#include "kernels/bake/nearest_eight.h"
#include "kernels/bake/triangle_distance.h"

namespace h6::kernels {

void eight_boxes_ref(const EightBoxes& boxes, const float p[3], float squared[8]) {
  for (int i = 0; i < 8; ++i) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const double gap =
          std::max({double(boxes.low[k][i]) - p[k], double(p[k]) - boxes.high[k][i], 0.0});
      sum += gap * gap;
    }
    squared[i] = float(sum);
  }
}

void eight_turned_boxes_ref(const EightTurnedBoxes& boxes, const float p[3], float squared[8]) {
  for (int i = 0; i < 8; ++i) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      double at = 0;
      for (int c = 0; c < 3; ++c) at += double(boxes.axis[k][c][i]) * p[c];
      const double gap = std::max(std::fabs(at - boxes.middle[k][i]) - boxes.half[k][i], 0.0);
      sum += gap * gap;
    }
    squared[i] = float(sum);
  }
}

void eight_triangles_ref(const double* corners, const float p[3], float squared[8]) {
  const double at[3] = {p[0], p[1], p[2]};
  for (std::size_t i = 0; i < 8; ++i) {
    const double* c = corners + 9 * i;
    squared[i] = float(point_triangle_squared(at, c, c + 3, c + 6));
  }
}

void nearest_search_ref(const NearestTree& tree, const float p[3], NearestFound* found) {
  for (std::uint32_t place = 0; place < tree.triangles; ++place) {
    float squared[8];
    eight_triangles(tree.leaf[place / 8], p, found->squared, squared);
    if (squared[place % 8] < found->squared)
      *found = {squared[place % 8], place, squared[place % 8]};
  }
}

}  // namespace h6::kernels
