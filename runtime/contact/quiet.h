// SPDX-License-Identifier: Apache-2.0
// quiet.h - for how long a pair that touched nothing can be left out: METHOD.md, Sec. 6.
//
// A traversal that finds nothing also finds how far the shell may move in the field's frame before
// a point can touch. Until shell and field have moved that far, a traversal would find nothing
// again, and there is none.
#pragma once
#include "runtime/contact/body.h"

namespace h6 {

struct Quiet {
  double way = 0;  // no point touches before it has moved so far in the field's frame [m]; 0: now
  double shift = 0, turn_a = 0, turn_b = 0;  // of the bodies, when that was found
  double arm = 0;                            // of a's farthest point about b's centre of mass [m]

  void begin(double free, const Body& a, const Body& b) {
    way = free;
    shift = a.travelled.shift + b.travelled.shift;
    turn_a = a.travelled.turn, turn_b = b.travelled.turn;
    arm = (a.x - b.x).norm() + a.radius;
  }
  // A point of a moves by a's shift and turn, and in b's frame also by b's.
  bool holds(const Body& a, const Body& b) const {
    const double shifted = a.travelled.shift + b.travelled.shift - shift;
    const double moved = shifted + (a.travelled.turn - turn_a) * a.radius +
                         (b.travelled.turn - turn_b) * (arm + shifted);
    return moved < way;
  }
};

}  // namespace h6
