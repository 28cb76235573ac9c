// SPDX-License-Identifier: Apache-2.0
// trace.h - the last seconds of a run as a timeline for chrome://tracing and ui.perfetto.dev: each
// frame with its stages, the helper's share on a thread of its own, wake-up times, late frames and
// their cause, contacts and depth.
#pragma once
#include <deque>
#include <filesystem>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"

namespace h6::io::view {

class Trace {
 public:
  // Keeps the newest `frames` frames.
  explicit Trace(std::size_t frames) : most_(frames) {}
  void add(const h6FrameRecord* rows, std::size_t count);
  // Writes JSON in the Trace Event Format, aside and then renamed.
  Outcome write(const std::filesystem::path& file) const;

 private:
  struct Row {
    double time, wakeup_us, frame_us, stage_us[H6_STAGE_COUNT], depth_voxels;
    double helper_start_us, helper_us;
    std::uint32_t helper_slices;
    std::uint64_t frame;
    std::uint32_t contacts, late;
    h6Status status;
  };
  std::size_t most_;
  std::deque<Row> rows_;
};

}  // namespace h6::io::view
