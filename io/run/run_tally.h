// SPDX-License-Identifier: Apache-2.0
// run_tally.h - sums up a run, frame by frame. Its memory does not grow with the length of the run.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "hapsix/hapsix.h"
#include "io/run/histogram.h"
#include "io/run/through_watch.h"
#include "io/scene/load_scene.h"
#include "io/scene/verdict.h"

namespace h6::cli {

struct RunTotals {
  io::Verdict verdict = io::Verdict::untouched;
  PopThroughReport through;
  std::optional<io::VerdictWatch::Entry> forbidden;  // the first time in a forbidden box
  // A sentence if the body ends more than three voxels from a hand that rests, with a coupling that
  // pulls as hard as it may; else empty.
  std::string left_behind;
  std::uint64_t frames = 0;
  h6Status status = 0;  // every bit that any frame had
  std::uint32_t contacts_max = 0;
  double contacts_mean = 0;           // over all frames
  double touching_contacts_mean = 0;  // over frames with a contact
  double max_depth_voxels = 0, final_depth_voxels = 0;
  double missed_depth_voxels = 0;        // bound on the depth that coarse frames missed
  double net_stiffness_max = 0;          // 0 unless the scene asks for it [N/m]
  double force_jump = 0;                 // largest change of the contact force between frames [N]
  double late_speed = 0;                 // RMS speed of the body's centre, last 0.2 s [m/s]
  double late_depth_swing = 0;           // peak-to-peak depth over the last 0.2 s [voxel]
  double late_hand_swing = 0;            // way across the first hand's motion, last 0.2 s [m]
  double max_force = 0, max_torque = 0;  // sent to the devices [N], [N m]
  h6Pose final_pose{}, hand_pose{};      // last pose of the first hand's body, and of that hand
  std::uint64_t state_hash = 0;
  // Its verdict says nothing about contacts: the program says `untouched` beside it.
  bool never_touched() const { return contacts_max == 0; }
};

struct RunTimes {
  Histogram frame_us, wakeup_us;
  std::array<Histogram, H6_STAGE_COUNT> stage_us;
};

class RunTally {
 public:
  // `rate` is in frames per second. `duration` of the run is in seconds; the tally needs it to find
  // the last 0.2 s.
  RunTally(const io::LoadedScene& loaded, double rate, double duration);
  // `contact_force` acts on the first hand's body [N]. Only `force_jump` needs it.
  void frame(const h6FrameRecord& record, const h6Vec3& contact_force = {});
  // Looks for points that passed through, which may take a while.
  RunTotals totals(const io::Progress& progress = {}) const;
  const RunTimes& times() const { return times_; }

 private:
  void late_frame(const h6FrameRecord& record);
  std::string left_behind() const;

  const io::LoadedScene& loaded_;
  RunTotals out_;  // without the means, the late figures and all that is judged
  RunTimes times_;
  io::VerdictWatch verdict_;
  ThroughWatch through_;
  double late_from_;
  h6Vec3 contact_force_{};
  h6Vec3 late_hand_low_{1e9, 1e9, 1e9}, late_hand_high_{-1e9, -1e9, -1e9};
  double contacts_ = 0, late_speed2_ = 0, late_low_ = 1e9, late_high_ = 0;
  std::uint64_t touching_ = 0, late_ = 0;
  std::uint32_t contacts_last_ = 0;
  h6Status status_last_ = 0;
};

}  // namespace h6::cli
