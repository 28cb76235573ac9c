// SPDX-License-Identifier: Apache-2.0
// view_request.h - the page's requests, parsed from a text that is not trusted.
#pragma once
#include <array>
#include <string>
#include <string_view>
#include <variant>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"

namespace h6::io::view {

// The mouse takes the hand, or gives it back to its path.
struct Grab {
  bool on = false;
};
// The wanted pose of the hand: the mesh frame of its body in the world [m], unit quaternion.
struct MoveHand {
  h6Pose pose{};
};
struct Clutch {
  bool on = false;
};
struct SetContact {
  std::string method;           // with its pieces, "gauss6+facing"; empty: unchanged
  double stiffness = 0;         // [N/m]; 0: unchanged
  double epsilon = 0;           // 0: unchanged
  double max_depth_voxels = 0;  // of the coupling; 0: unchanged
  double hand_stiffness = 0;    // of the coupling [N/m]; 0: unchanged
};
// 1: real time; between 0 and 1: slow motion; 0: paused.
struct SetPace {
  double pace = 1;
};
struct Reset {};
// Keeps where everything is; goes back to what was kept last.
struct Keep {};
struct GoBack {};
struct Record {
  bool on = false;
};
// A plane through the first field: its normal axis 0 .. 2, and its place on it, 0 .. 1 of the
// field's extent.
struct Slice {
  int axis = 2;
  double at = 0.5;
};
using ViewRequest = std::variant<Grab, MoveHand, Clutch, SetContact, SetPace, Reset, Keep, GoBack,
                                 Record, Slice>;

// {"do": "grab", "on": true}, {"do": "hand", "p": [x, y, z], "q": [w, x, y, z]}, ... Every number
// must be finite and in its range; a failure is a sentence for the page.
Result<ViewRequest> parse_request(std::string_view text);

}  // namespace h6::io::view
