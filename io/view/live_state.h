// SPDX-License-Identifier: Apache-2.0
// live_state.h - the messages that show a run on the page, made from the loop's rows and its newest
// contacts.
#pragma once
#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "io/scene/load_scene.h"
#include "io/view/envelope.h"
#include "io/view/view_request.h"

namespace h6::io::view {

class LiveState {
 public:
  explicit LiveState(const LoadedScene& loaded);
  // The contact and coupling settings in force, without zeros that the engine would replace.
  void settings(const h6ContactDef& contact, const h6CouplingDef& coupling);
  // A run begins and time restarts at zero.
  void begin();
  void rows(const h6FrameRecord* rows, std::size_t count);
  void contacts(const h6LoopView& view);
  void recording(bool on) { recording_ = on; }

  // {"kind": "scene", ...} with the drawn bodies; `remarks` gets a sentence for each part that
  // cannot be drawn.
  Message scene_message(std::vector<std::string>& remarks) const;
  // {"kind": "state", ...} with the rows since the last such message.
  Message state_message();
  // {"kind": "note", "text"}.
  static Message note(const std::string& text);
  // {"kind": "slice", ...}: signed distance on a plane through the first field, 0 .. 255 for -64 ..
  // +64 voxels. Null when no body has a field.
  Message slice_message(const Slice& slice) const;

  const h6FrameRecord& last() const { return last_; }
  bool any() const { return any_; }

 private:
  static constexpr std::size_t kBins = 64, kRow = 6;
  nlohmann::ordered_json contact_json() const;
  nlohmann::ordered_json deepest_json() const;
  const LoadedScene& loaded_;
  h6ContactDef contact_{};
  h6CouplingDef coupling_{};
  h6FrameRecord last_{};
  bool any_ = false, recording_ = false;
  h6ViewContact deepest_{};  // of the newest frame; its depth is 0 where nothing touches
  h6Status status_ = 0;  // of all rows since the last message
  h6Cause cause_ = H6_CAUSE_NONE;
  std::uint64_t late_[3] = {};
  std::vector<float> rows_, poses_, bends_, p_, n_, t_, w_, d_;
  std::vector<std::uint32_t> frame_bins_, wake_bins_;
  std::array<double, 6> stiffness_{};  // net, sum of w k N N^T: xx yy zz xy xz yz [N/m]
};

}  // namespace h6::io::view
