// SPDX-License-Identifier: Apache-2.0
// run_tally.h - sums a run up, frame by frame. Memory does not grow with its length.
#pragma once
#include <array>
#include <cstdint>

#include "hapsix/hapsix.h"
#include "io/run/histogram.h"
#include "io/scene/load_scene.h"
#include "io/scene/verdict.h"

namespace h6::cli {

struct RunTotals {
  io::Verdict verdict = io::Verdict::held;
  std::uint64_t frames = 0;
  h6Status status = 0;  // all bits seen
  std::uint32_t contacts_max = 0;
  double contacts_mean = 0;           // over all frames
  double touching_contacts_mean = 0;  // over frames with a contact
  double max_depth_voxels = 0, final_depth_voxels = 0;
  double missed_depth_voxels = 0;        // of coarse frames, the bound
  double net_stiffness_max = 0;          // where the scene asks for it [N/m]
  double force_jump = 0;                 // largest change of the contact force between frames [N]
  double late_speed = 0;                 // RMS of the body's centre over the last 0.2 s [m/s]
  double late_depth_swing = 0;           // peak to peak over the last 0.2 s [voxel]
  double max_force = 0, max_torque = 0;  // as sent to the devices [N], [N m]
  h6Pose final_pose{}, hand_pose{};      // of the first hand's body, and of that hand
  std::uint64_t state_hash = 0;
};

struct RunTimes {
  Histogram frame_us, wakeup_us;
  std::array<Histogram, H6_STAGE_COUNT> stage_us;
};

class RunTally {
 public:
  // `duration` of the run [s]: its last 0.2 s are looked at apart.
  RunTally(const io::LoadedScene& loaded, double rate, double duration);
  // `contact_force` on the first hand's body, where somebody looks at it [N].
  void frame(const h6FrameRecord& record, const h6Vec3& contact_force = {});
  RunTotals totals() const;
  const RunTimes& times() const { return times_; }

 private:
  void late_frame(const h6FrameRecord& record);

  RunTotals out_;  // what needs no division
  RunTimes times_;
  io::VerdictWatch verdict_;
  double late_from_;
  h6Vec3 contact_force_{};
  double contacts_ = 0, late_speed2_ = 0, late_low_ = 1e9, late_high_ = 0;
  std::uint64_t touching_ = 0, late_ = 0;
};

}  // namespace h6::cli
