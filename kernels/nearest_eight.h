// nearest_eight.h - one point against eight boxes or eight triangles: the inner loops of a
// closest-point search. Float, and never more than the truth: what passes is looked at in double.
#pragma once
#include <cstddef>
#include <cstdint>

namespace h6::kernels {

struct EightBoxes {
  alignas(32) float low[3][8], high[3][8];
};
// squared[i] <= squared distance of p to box i. An empty box (low > high) is far away. Returns a
// bit for each that is below `most`.
std::uint32_t eight_boxes(const EightBoxes& boxes, const float p[3], float most, float squared[8]);
void eight_boxes_ref(const EightBoxes& boxes, const float p[3], float squared[8]);

// Boxes with axes of their own (of unit length and at right angles, up to float): on a slanted
// surface they are flat where boxes along the grid are thick.
struct EightTurnedBoxes {
  alignas(32) float axis[3][3][8];             // [axis][coordinate]
  alignas(32) float middle[3][8], half[3][8];  // along the axes; half < 0: empty
};
// As eight_boxes, for coordinates up to 1024; rounding along the axes, 4e-4 in all, is not in the
// bound: make halves larger by 5e-4.
std::uint32_t eight_turned_boxes(const EightTurnedBoxes& boxes, const float p[3], float most,
                                 float squared[8]);
void eight_turned_boxes_ref(const EightTurnedBoxes& boxes, const float p[3], float squared[8]);

struct EightTriangles {
  alignas(32) float a[3][8], ab[3][8], ac[3][8];  // first corner, edges from it
};
// squared[i] <= squared distance of p to triangle i: by less than 1e-4 of it, save for
// triangles a thousand times as large as their distance, and on slivers a little more.
// Returns a bit for each that is below `most`.
std::uint32_t eight_triangles(const EightTriangles& triangles, const float p[3], float most,
                              float squared[8]);
void eight_triangles_ref(const EightTriangles& triangles, const float p[3], float squared[8]);

}  // namespace h6::kernels
