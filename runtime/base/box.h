// SPDX-License-Identifier: Apache-2.0
// box.h - axis-aligned boxes.
#pragma once
#include <cmath>

#include "runtime/base/math.h"

namespace h6 {

// Empty by default. The frame and the unit are those of its corners.
struct Box {
  Vec3 low = Vec3::Constant(HUGE_VAL), high = Vec3::Constant(-HUGE_VAL);
  bool empty() const { return !(low[0] <= high[0]); }
};

inline Box united(const Box& a, const Box& b) {
  return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
}
inline Box grown(const Box& a, double by) {
  return {a.low - Vec3::Constant(by), a.high + Vec3::Constant(by)};
}
// False for an empty box, and for a NaN.
inline bool overlap(const Box& a, const Box& b) {
  return a.low[0] <= b.high[0] && b.low[0] <= a.high[0] && a.low[1] <= b.high[1] &&
         b.low[1] <= a.high[1] && a.low[2] <= b.high[2] && b.low[2] <= a.high[2];
}
inline bool holds(const Box& outer, const Box& inner) {
  return inner.empty() || ((outer.low.array() <= inner.low.array()).all() &&
                           (inner.high.array() <= outer.high.array()).all());
}
// The box around a box that is turned by R and then shifted.
inline Box placed(const Box& box, const Mat3& R, const Vec3& shift) {
  if (box.empty()) return box;
  const Vec3 centre = R * (0.5 * (box.low + box.high)) + shift;
  const Vec3 half = R.cwiseAbs() * (0.5 * (box.high - box.low));
  return {centre - half, centre + half};
}
// The distance of the farthest corner; 0 for an empty box.
inline double farthest(const Box& box, const Vec3& from) {
  if (box.empty()) return 0;
  return (box.low - from).cwiseAbs().cwiseMax((box.high - from).cwiseAbs()).norm();
}

}  // namespace h6
