// SPDX-License-Identifier: Apache-2.0
// view_request.h - what the page may ask for, read from a text that anyone could have sent.
#pragma once
#include <array>
#include <string>
#include <string_view>
#include <variant>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"

namespace h6::io::view {

// Take the hand, or give it back to its path.
struct Grab {
  bool on = false;
};
// Where the page wants the hand to be: mesh frame of its body, world frame [m], unit quaternion.
struct MoveHand {
  h6Pose pose{};
};
struct Clutch {
  bool on = false;
};
struct SetContact {
  std::string method;           // with its pieces, "gauss6+facing"; empty: as it is
  double stiffness = 0;         // [N/m]; 0: as it is
  double epsilon = 0;           // 0: as it is
  double max_depth_voxels = 0;  // of the coupling; 0: as it is
};
// 1: real time; below: slow motion; 0: paused.
struct SetPace {
  double pace = 1;
};
struct Reset {};
struct Record {
  bool on = false;
};
// A plane through the first field: axis 0 .. 2, and where along it, 0 .. 1 of the field's extent.
struct Slice {
  int axis = 2;
  double at = 0.5;
};
using ViewRequest = std::variant<Grab, MoveHand, Clutch, SetContact, SetPace, Reset, Record, Slice>;

// {"do": "grab", "on": true}, {"do": "hand", "p": [x, y, z], "q": [w, x, y, z]}, ... Every number
// is checked to be finite and in its range; a failure is a sentence for the page.
Result<ViewRequest> parse_request(std::string_view text);

}  // namespace h6::io::view
