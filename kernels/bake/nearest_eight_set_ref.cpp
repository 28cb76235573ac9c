// SPDX-License-Identifier: Apache-2.0
// nearest_eight_set_ref.cpp - prepares triangles for nearest_eight.cpp, and the boxes around eight:
// the specification, in double.
#include <algorithm>
#include <cmath>

#include "kernels/bake/nearest_eight.h"

namespace h6::kernels {
namespace {

struct Row {
  double x, y, z;
};
Row minus(const double* a, const double* b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Row times(double s, const Row& a) { return {s * a.x, s * a.y, s * a.z}; }
double dot(const Row& a, const Row& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Row cross(const Row& a, const Row& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double length(const Row& a) { return std::sqrt(dot(a, a)); }

// Unit, across a.
Row any_normal(const Row& a) {
  const double x = std::fabs(a.x), y = std::fabs(a.y), z = std::fabs(a.z);
  const Row n = x <= y && x <= z ? Row{0, -a.z, a.y}
                : y <= z         ? Row{a.z, 0, -a.x}
                                 : Row{-a.y, a.x, 0};
  return times(1 / length(n), n);
}

void put(float (&to)[3][8], std::size_t i, const Row& a) {
  to[0][i] = float(a.x);
  to[1][i] = float(a.y);
  to[2][i] = float(a.z);
}
void put(float (&to)[2][8], std::size_t i, double x, double y) {
  to[0][i] = float(x);
  to[1][i] = float(y);
}

// Ends along an axis.
void reach_along(const LeafCorners& corners, const Row& axis, double& low, double& high) {
  low = 1e30;
  high = -1e30;
  for (const auto& corner : corners.at)
    for (std::size_t i = 0; i < 8; ++i) {
      const double at = dot({corner[0][i], corner[1][i], corner[2][i]}, axis);
      low = std::min(low, at);
      high = std::max(high, at);
    }
}

}  // namespace

void set_triangle(EightTriangles& t, std::size_t i, const double a[3], const double b[3],
                  const double c[3]) {
  constexpr double kFlat = 1e-6, kSliver = 1e-2;
  constexpr float kDigits = 4e-6f;  // thirty times the rounding of a float
  const double* corner[3] = {a, b, c};
  Row edge[3];
  double size[3];
  std::size_t e = 0;  // longest
  for (std::size_t k = 0; k < 3; ++k) {
    edge[k] = minus(corner[(k + 1) % 3], corner[k]);
    size[k] = length(edge[k]);
    if (size[k] > size[e]) e = k;
  }
  // The longest edge comes first: its direction is the most precise.
  const double first = size[e], second = size[(e + 1) % 3], third = size[(e + 2) % 3];
  const double by_first = first > 1e-9 ? 1 / first : 0;
  for (std::size_t k = 0; k < 3; ++k) t.a[k][i] = float(corner[e][k]);
  t.longest2[i] = float(first * first);
  t.half[0][i] = float(first / 2);
  const Row x = by_first > 0 ? times(by_first, edge[e]) : Row{1, 0, 0};
  const Row n = cross(edge[e], edge[(e + 1) % 3]);
  const double area2 = length(n), height = area2 * by_first;
  put(t.frame[0], i, x);
  if (!(height > kFlat)) {  // becomes its longest edge, three times, without an inside
    const Row z = any_normal(x);
    put(t.frame[1], i, cross(z, x));
    put(t.frame[2], i, z);
    put(t.along1, i, 1, 0);
    put(t.along2, i, -1, 0);
    t.half[1][i] = t.half[2][i] = t.half[0][i];
    t.from1[i] = -t.half[0][i];
    t.off1[i] = t.width2[i] = 0;
    t.inside[i] = -1e30f;
    return;
  }
  const Row z = times(1 / area2, n), y = cross(z, x);
  put(t.frame[1], i, y);
  put(t.frame[2], i, z);
  const Row &to_third = edge[(e + 1) % 3], &back = edge[(e + 2) % 3];
  const double by_second = 1 / second, by_third = 1 / third;
  const double x1 = dot(to_third, x) * by_second, y1 = height * by_second;
  put(t.along1, i, x1, y1);
  put(t.along2, i, dot(back, x) * by_third, -height * by_third);
  t.half[1][i] = float(second / 2);
  t.half[2][i] = float(third / 2);
  t.from1[i] = float(-x1 * first - second / 2);
  t.off1[i] = float(y1 * first);
  const bool sliver = height < kSliver * first;
  const double within = sliver ? area2 / (first + second + third) : 0;
  t.width2[i] = float(within * within);
  t.inside[i] = sliver ? -1e30f : kDigits;
}

void set_leaf_ref(const LeafCorners& corners, EightTriangles& triangles, EightTurnedBoxes& turned,
                  EightBoxes& boxes, std::size_t box) {
  Row mean{0, 0, 0};
  for (std::size_t i = 0; i < 8; ++i) {
    double c[3][3];
    for (std::size_t v = 0; v < 3; ++v)
      for (std::size_t k = 0; k < 3; ++k) c[v][k] = corners.at[v][k][i];
    set_triangle(triangles, i, c[0], c[1], c[2]);
    const Row n = cross(minus(c[1], c[0]), minus(c[2], c[0]));
    const double side = dot(n, mean) < 0 ? -1 : 1;
    mean = {mean.x + side * n.x, mean.y + side * n.y, mean.z + side * n.z};
  }
  const double size = length(mean);
  const Row grid[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Row plane[3] = {grid[0], grid[1], grid[2]};
  if (size > 1e-6) {
    plane[0] = times(1 / size, mean);
    plane[1] = any_normal(plane[0]);
    plane[2] = cross(plane[0], plane[1]);
  }
  double least = 1e30;
  const Row* const frames[] = {grid, plane};
  for (const Row* frame : frames) {
    double low[3], high[3], product = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      reach_along(corners, frame[k], low[k], high[k]);
      product *= high[k] - low[k] + 1;
    }
    if (frame == grid)
      for (std::size_t k = 0; k < 3; ++k) {
        boxes.low[k][box] = float(low[k]) - kBoxMargin;
        boxes.high[k][box] = float(high[k]) + kBoxMargin;
      }
    if (product >= least) continue;
    least = product;
    for (std::size_t k = 0; k < 3; ++k) {
      const double axis[3] = {frame[k].x, frame[k].y, frame[k].z};
      for (std::size_t c = 0; c < 3; ++c) turned.axis[k][c][box] = float(axis[c]);
      turned.middle[k][box] = float((low[k] + high[k]) / 2);
      turned.half[k][box] = float((high[k] - low[k]) / 2) + kTurnedMargin;
    }
  }
}

}  // namespace h6::kernels
