// SPDX-License-Identifier: Apache-2.0
// scripted_hand.h - a hand that executes the lines of a text:
//
//   move DX DY DZ in SECONDS      straight, world frame, in the text's unit of length
//   turn RX RY RZ in SECONDS      about the grip: a rotation vector, world frame [degrees]
//   home in SECONDS               back to its first pose
//   hold SECONDS
//   press N, release N            button 0 to 31
//
// A # begins a comment.
#pragma once
#include <string>
#include <vector>

#include "device/hand_path.h"
#include "hapsix/result.h"

namespace h6::device {

struct HandScript {
  struct Buttons {
    double time;            // [s]
    std::uint32_t buttons;  // from then on
  };
  HandPath path;
  std::vector<Buttons> buttons;  // in order of time
};

// `unit`: metres per unit of length. `grip`: mesh frame [m]. Fails with a sentence that names the
// line in error, or when there are more than 10,000 lines.
Result<HandScript> read_hand_script(const std::string& text, double unit, const h6Pose& home,
                                    const h6Vec3& grip);

// Adds the buttons of a script to another device, which follows the script's path and must outlive
// this object.
class ScriptedHand {
 public:
  ScriptedHand(const h6Device& hand, std::vector<HandScript::Buttons> buttons)
      : hand_(hand), buttons_(std::move(buttons)) {}
  h6Device device();

 private:
  std::uint32_t pressed(double time) const;
  h6Device hand_;
  std::vector<HandScript::Buttons> buttons_;
};

}  // namespace h6::device
