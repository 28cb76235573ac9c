// nearest_eight_ref.cpp - the specification of nearest_eight.cpp: the distances
// themselves, in double.
#include <algorithm>
#include <cmath>

#include "kernels/nearest_eight.h"
#include "kernels/triangle_distance.h"

namespace h6::kernels {

void eight_boxes_ref(const EightBoxes& boxes, const float p[3], float squared[8]) {
  for (int i = 0; i < 8; ++i) {
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const double gap = std::max({double(boxes.low[k][i]) - p[k],
                                   double(p[k]) - boxes.high[k][i], 0.0});
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

void eight_triangles_ref(const EightTriangles& t, const float p[3], float squared[8]) {
  for (int i = 0; i < 8; ++i) {
    double at[3], a[3], b[3], c[3];
    for (int k = 0; k < 3; ++k) {
      at[k] = p[k];
      a[k] = t.a[k][i];
      b[k] = a[k] + t.ab[k][i];
      c[k] = a[k] + t.ac[k][i];
    }
    squared[i] = float(point_triangle_squared(at, a, b, c));
  }
}

}  // namespace h6::kernels
