// SPDX-License-Identifier: Apache-2.0
// nearest_eight.h - one point against eight boxes or eight triangles: the inner loops of a
// closest-point search. They work in float and return lower bounds; candidates are computed again
// in double.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

struct EightBoxes {
  alignas(32) float low[3][8], high[3][8];
};
// squared[i] <= squared distance of p to box i. An empty box (low > high) is far away. Returns a
// bit for each box below `most`.
std::uint32_t eight_boxes(const EightBoxes& boxes, const float p[3], float most, float squared[8]);
void eight_boxes_ref(const EightBoxes& boxes, const float p[3], float squared[8]);

// Boxes with their own orthonormal axes (to float precision): on a slanted surface they are flat
// where boxes along the grid are thick.
struct EightTurnedBoxes {
  alignas(32) float axis[3][3][8];             // [axis][coordinate]
  alignas(32) float middle[3][8], half[3][8];  // along the axes; half < 0: empty
};
// As eight_boxes, for coordinates up to 1024. The bound does not cover rounding along the axes,
// 4e-4 in all: make the halves larger by 5e-4.
std::uint32_t eight_turned_boxes(const EightTurnedBoxes& boxes, const float p[3], float most,
                                 float squared[8]);
void eight_turned_boxes_ref(const EightTurnedBoxes& boxes, const float p[3], float squared[8]);

// Triangles in frames at their first corners. In the plane every edge has a direction, and a normal
// to the triangle's side.
struct EightTriangles {
  alignas(32) float a[3][8];                     // first corner
  alignas(32) float frame[3][3][8];              // along the first edge, off it, normal
  alignas(32) float along1[2][8], along2[2][8];  // the other edges, in the plane
  alignas(32) float half[3][8];                  // lengths of edges
  alignas(32) float from1[8], off1[8];           // first corner: from the middle of edge 1, off it
  alignas(32) float longest2[8];                 // squared length
  alignas(32) float width2[8];                   // slivers: squared inradius; else 0
  alignas(32) float inside[8];                   // tolerance off an edge that counts as inside
};
// Corners are x y z. A triangle of height 1e-6 or less becomes its longest edge.
void set_triangle(EightTriangles& triangles, std::size_t i, const double a[3], const double b[3],
                  const double c[3]);
// Corners of eight triangles, within 1024 of the origin.
struct LeafCorners {
  alignas(64) double at[3][3][8];  // [corner][coordinate][triangle]
};
// Fills all eight, box `box` around them along the grid, and the turned box: along the grid or
// along their mean plane, whichever is smaller. Boxes are enlarged by their margin.
inline constexpr float kBoxMargin = 2.5e-4f, kTurnedMargin = 1e-3f;
void set_leaf(const LeafCorners& corners, EightTriangles& triangles, EightTurnedBoxes& turned,
              EightBoxes& boxes, std::size_t box);
void set_leaf_ref(const LeafCorners& corners, EightTriangles& triangles, EightTurnedBoxes& turned,
                  EightBoxes& boxes, std::size_t box);
// squared[i] <= squared distance of p to triangle i, whose first corner is rounded to float. The
// bound is lower by less than 1e-4 of the square, except for triangles a thousand times as large as
// their distance; on slivers it is a little lower. Returns a bit for each triangle below `most`.
std::uint32_t eight_triangles(const EightTriangles& triangles, const float p[3], float most,
                              float squared[8]);
// corners: 8 x 3 corners x 3 coordinates.
void eight_triangles_ref(const double* corners, const float p[3], float squared[8]);

// A tree: triangles in eights, boxes around eights of triangles, boxes around eights of boxes ...
struct NearestTree {
  static constexpr std::size_t kMostLevels = 10;
  const EightTriangles* leaf = nullptr;
  const EightTurnedBoxes* around_leaf = nullptr;  // level 0; [i]: around leaves 8 i .. 8 i + 7
  const EightBoxes* level[kMostLevels] = {};  // [k][i], k > 0: around 8 i .. 8 i + 7 of level k -
                                              // 1; the last level has one
  std::uint32_t levels = 0, triangles = 0;
};
struct NearestFound {
  float squared;        // the least lower bound of eight_triangles
  std::uint32_t place;  // place of that triangle in the tree
  float above;          // upper bound of the squared distance to that triangle
};
// Looks for a triangle nearer than found->squared, first in the leaves start[0..starts-1], and
// stops at one whose square is not above `enough`.
void nearest_search(const NearestTree& tree, const float p[3], const std::uint32_t* start,
                    std::size_t starts, float enough, NearestFound* found);
// All triangles, one after the other.
void nearest_search_ref(const NearestTree& tree, const float p[3], NearestFound* found);

}  // namespace h6::kernels
