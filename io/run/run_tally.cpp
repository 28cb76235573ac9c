// SPDX-License-Identifier: Apache-2.0
// run_tally.cpp - sums up a run, frame by frame.
#include "io/run/run_tally.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "hapsix/vector.h"

namespace h6::cli {
namespace {

constexpr double kLate = 0.2;     // the same window as the verdict's [s]
constexpr double kSlides = 2e-3;  // [m/s]
constexpr double kFarBehind = 3;  // [voxel]

// The centre of mass of the body that the first hand holds.
h6Vec3 watched_com(const io::LoadedScene& loaded) {
  return loaded.hands.empty() ? h6Vec3{}
                              : loaded.bodies[static_cast<std::size_t>(loaded.hands[0].body)].com;
}

}  // namespace

RunTally::RunTally(const io::LoadedScene& loaded, double rate, double duration)
    : loaded_(loaded),
      verdict_(loaded.scene.verdict, loaded.watched_points(), watched_com(loaded), rate),
      through_(loaded),
      late_from_(duration - kLate) {}

void RunTally::frame(const h6FrameRecord& r, const h6Vec3& contact_force) {
  const h6FrameReport& f = r.report;
  const auto most = [](auto& value, auto candidate) { value = std::max(value, candidate); };
  ++out_.frames;
  out_.status |= f.status;
  contacts_ += f.contacts;
  touching_ += f.contacts > 0;
  most(out_.contacts_max, f.contacts);
  most(out_.max_depth_voxels, f.max_depth_voxels);
  most(out_.missed_depth_voxels, f.missed_depth_voxels);
  most(out_.net_stiffness_max, f.net_stiffness_max);
  most(out_.force_jump, norm(contact_force - contact_force_));
  contact_force_ = contact_force;
  for (const h6DeviceCommand& c : r.command) {
    most(out_.max_force, norm(c.wrench.force));
    most(out_.max_torque, norm(c.wrench.torque));
  }
  times_.frame_us.add(f.frame_us);
  times_.wakeup_us.add(r.wakeup_us);
  for (std::size_t s = 0; s < H6_STAGE_COUNT; ++s) times_.stage_us[s].add(f.stage_us[s]);
  out_.final_depth_voxels = f.max_depth_voxels;
  out_.final_pose = r.body[0].pose;
  out_.hand_pose = r.hand[0].pose;
  out_.state_hash = f.state_hash;
  contacts_last_ = f.contacts, status_last_ = f.status;
  if (r.time >= late_from_) late_frame(r);
  through_.frame(r);
  verdict_.frame(r.time, r.hand[0].pose, r.hand[0].velocity, r.body[0], f.max_depth_voxels,
                 (f.status & H6_STATE_NOT_FINITE) == 0);
}

void RunTally::late_frame(const h6FrameRecord& r) {
  const double speed = norm(r.body[0].velocity.linear);
  late_speed2_ += speed * speed, ++late_;
  late_low_ = std::min(late_low_, r.report.max_depth_voxels);
  late_high_ = std::max(late_high_, r.report.max_depth_voxels);
  for (double h6Vec3::*i : {&h6Vec3::x, &h6Vec3::y, &h6Vec3::z}) {
    late_hand_low_.*i = std::min(late_hand_low_.*i, r.hand[0].pose.p.*i);
    late_hand_high_.*i = std::max(late_hand_high_.*i, r.hand[0].pose.p.*i);
  }
}

std::string RunTally::left_behind() const {
  if (loaded_.hands.empty() || loaded_.field_voxels.empty()) return "";
  const h6HandDef& hand = loaded_.hands[0];
  const h6HandFilterDef& filter = hand.filter;
  // Elsewhere the device's pose is not where the body is wanted.
  const bool plain = hand.mode == H6_IMPEDANCE && filter.motion_scale == 1 &&
                     filter.rotation_scale == 1 && !filter.relative && filter.clutch_buttons == 0;
  if (!plain || !(status_last_ & H6_COUPLING_SATURATED) || !verdict_.hand_rests()) return "";
  const double voxel = *std::min_element(loaded_.field_voxels.begin(), loaded_.field_voxels.end());
  const double lag = verdict_.lag();
  if (!(lag > kFarBehind * voxel)) return "";
  char text[240];
  std::snprintf(
      text, sizeof text,
      "'%.60s' ends %.3g mm (%.1f voxels) from its hand, which rests: the coupling pulls as "
      "hard as it may, and ",
      loaded_.scene.hands[0].body.c_str(), 1e3 * lag, lag / voxel);
  std::string why = contacts_last_ == 0   ? "nothing touches"
                    : contacts_last_ == 1 ? "one contact holds the part"
                                          : std::to_string(contacts_last_) +
                                                " contacts hold the part";
  if (const double slide = verdict_.slide(); slide > kSlides) {
    char how[60];
    std::snprintf(how, sizeof how, ", which still slides by %.2g mm/s", 1e3 * slide);
    why += how;
  }
  return text + why;
}

RunTotals RunTally::totals(const io::Progress& progress) const {
  RunTotals out = out_;
  out.through = through_.judge(progress);
  out.forbidden = verdict_.entry();
  out.verdict = verdict_.verdict(out.through.first.has_value());
  if (loaded_.hands.empty() && out.verdict == io::Verdict::held) out.verdict = io::Verdict::unheld;
  out.left_behind = left_behind();
  if (out.frames) out.contacts_mean = contacts_ / static_cast<double>(out.frames);
  if (touching_) out.touching_contacts_mean = contacts_ / static_cast<double>(touching_);
  if (late_) {
    out.late_speed = std::sqrt(late_speed2_ / static_cast<double>(late_));
    out.late_depth_swing = late_high_ - late_low_;
    out.late_hand_swing = norm(late_hand_high_ - late_hand_low_);
  }
  return out;
}

}  // namespace h6::cli
