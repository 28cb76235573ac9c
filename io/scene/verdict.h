// SPDX-License-Identifier: Apache-2.0
// verdict.h - judges a run. It does not know the contact method.
//
// A run gets the first verdict that applies, in this order:
//   unstable  a state was not finite, or a body was faster than 100x the hand's peak speed. A peak
//             below 10 mm/s counts as 10 mm/s, so that a hand at rest still allows small motions.
//             A body that starts away from the hand flies to it: as if the hand had moved that far
//             in a second.
//   through   a shell point passed through the environment's mesh (pop_through.h, which the caller
//             asks), or a shell point or the centre of mass was in a forbidden box
//   chatters  the hand was still for at least 0.2 s, and in the last 0.2 s of that phase the RMS
//             point speed about the mean motion was above 2 mm/s or the peak-to-peak depth above
//             0.1 voxel. Only the end of a phase is judged: the body may settle first, and a limit
//             cycle stays to the end. The mean motion is no chatter: a part that a far hand drags
//             along a surface slides (slide() says how fast).
//   sunk      the run ends with a point deeper than 3 voxels, where a field knows no depths
//   arrived   the scene has a target, and the run ends there
//   stuck     the scene has a target, and the run ends elsewhere
//   untouched nothing was ever deeper than 0
//   unheld    the scene has no hand, so nothing was held (RunTally says so)
//   held      none of the others applies
//
// Speeds are root mean squares (RMS) over all shell points, so that rotation counts like
// translation. Stillness is measured on the shell points as if they moved with the hand: the hand
// is still while they stay within 0.02 mm (RMS) of their places at the start of the phase, and no
// velocity of the hand takes them farther in one frame.
#pragma once
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/scene/scene.h"

namespace h6::io {

enum class Verdict { unstable, through, chatters, sunk, arrived, stuck, untouched, unheld, held };
const char* verdict_name(Verdict verdict);

// Watches a run frame by frame. Its memory does not grow with the length of the run.
class VerdictWatch {
 public:
  // `points` are the shell points of the first hand's body, and `com` is its centre of mass, both
  // in the mesh frame [m]. `rate` is in frames per second.
  VerdictWatch(const SceneVerdict& rules, std::vector<h6Vec3> points, h6Vec3 com, double rate);
  // `time` [s] must increase from call to call. `body` gives the velocity of the centre of mass,
  // `hand_velocity` that of the mesh frame's origin.
  void frame(double time, const h6Pose& hand, const h6Velocity& hand_velocity,
             const h6BodyState& body, double max_depth_voxels, bool state_finite);
  Verdict verdict(bool popped_through = false) const;
  // When and where a shell point or the centre of mass first was in a forbidden box.
  struct Entry {
    double time;   // [s]
    h6Vec3 place;  // world frame [m]
  };
  const std::optional<Entry>& entry() const { return entry_; }
  // Whether the hand has been still for at least 0.2 s, and how far (RMS over the points) the body
  // is from it [m]. Both mean the last frame.
  bool hand_rests() const { return !first_ && last_time_ - still_since_ >= kRest; }
  double lag() const { return first_ ? 0 : std::sqrt(mean_motion2(last_hand_, last_body_.pose)); }
  // The RMS speed of the points' mean motion in the last 0.2 s [m/s]; 0 before.
  double slide() const;

 private:
  static constexpr double kRest = 0.2 - 1e-6;  // [s]
  // Neighbouring points in one bounding sphere, mesh frame [m]. One test of the sphere can rule out
  // all of them.
  struct Cluster {
    h6Vec3 centre;
    double radius;
    std::uint32_t first, count;
  };
  struct Window {  // ring buffer of the last 0.2 s
    std::vector<double> speed2, depth;
    std::vector<h6Pose> from;  // where each frame's motion began
    std::size_t next = 0, filled = 0;
  };

  void cluster_points(std::size_t first, std::size_t count);
  double mean_speed2(const h6Vec3& origin_velocity, const h6Vec3& angular, const h6Quat& q) const;
  double mean_motion2(const h6Pose& from, const h6Pose& to) const;
  std::optional<h6Vec3> entered(const h6Pose& body) const;
  void watch_stillness(double time, const h6Pose& hand, const h6Velocity& velocity);
  bool chatters_now(double time) const;
  bool arrived() const;

  SceneVerdict rules_;
  std::vector<h6Vec3> points_;
  std::vector<Cluster> clusters_;
  h6Vec3 com_, mean_{};    // mean_ is the mean of the points, mesh frame [m]
  double second_[6] = {};  // mean of p pT over the points, xx yy zz xy xz yz [m^2]
  double rate_;
  double peak_hand_speed2_ = 0, peak_speed2_ = 0, start_lag2_ = 0;
  std::optional<Entry> entry_;
  bool finite_ = true, touched_ = false, chattered_ = false, first_ = true;
  double still_since_ = 0, last_time_ = 0;
  h6Pose still_hand_{};  // pose of the hand at the start of the still phase
  h6Pose last_hand_{};
  h6BodyState last_body_{};
  double last_depth_ = 0;  // [voxel]
  Window window_;
};

}  // namespace h6::io
