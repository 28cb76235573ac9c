// SPDX-License-Identifier: Apache-2.0
// report.h - recordings as one HTML file that opens from disk: strips as in Fig. 10 of Xu & Barbic
// 2016, a replay in space with the Gauss sphere, the time of a frame by stage, late frames, events,
// configuration, hashes, verdict. Several recordings are drawn over one another.
//
// The file stays below 10 MB for any recording: strips keep the least and the greatest value of
// each of 3,000 spans; the replay keeps 60 poses a second (4,000 at most) and the 64 deepest
// contacts of each; all bodies together keep 60,000 triangles.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/record/late_judge.h"
#include "io/record/recording.h"
#include "io/scene/load_scene.h"

namespace h6::io::view {

// One contact at one instant, in the world frame.
struct ReportContact {
  std::array<float, 3> position, normal, torque_direction;  // [m], unit, unit
  float weight, depth;                                      // share, [m]
};

// The deepest contact of a run, when a replay has shown it.
struct TightestPlace {
  double time;                  // [s]
  std::array<double, 3> place;  // world frame, in `unit`
  std::string unit;             // the scene's, "mm"
  std::string part, other;      // bodies: the one with the shell, the one with the field
};

// A recording for a report, handed over in pieces and in order.
class ReportRun {
 public:
  // `frames` is the number of all its frames.
  ReportRun(std::string label, RecordingHead head, std::uint64_t frames);
  void add(const std::vector<h6FrameRecord>& frames);
  // The time of a late frame that was stepped again for the report [us]; before add() of that
  // frame.
  void stepped_again(std::uint64_t frame, double us) { again_us_[frame] = us; }
  void events(std::vector<RecordingEvent> events, std::string summary_json);

  void tightest(TightestPlace place) { tightest_ = std::move(place); }

  // The frames whose contacts the replay shows, ascending; contacts(i, ...) sets those of the i-th.
  const std::vector<std::uint64_t>& replay_frames() const { return replay_frames_; }
  void contacts(std::size_t sample, std::vector<ReportContact> all);
  // bend(i, ...) sets the coordinates of the bodies that bend in the i-th of these frames, one body
  // after another.
  void bend(std::size_t sample, const std::vector<float>& q);

 private:
  friend class ReportWriter;
  friend Result<std::string> make_report(const std::vector<ReportRun>& runs,
                                         const LoadedScene* scene, const std::string& why);
  struct Span {
    std::uint64_t frames = 0;
    double time = 0;
    std::array<float, 5> low{}, high{};
  };
  void row(const h6FrameRecord& r);
  void late_frame(LateFrame late);
  void close_span();

  std::string label_;
  RecordingHead head_;
  std::string summary_;
  std::uint64_t frames_, span_frames_, seen_ = 0, late_[3] = {};
  std::size_t late_left_out_ = 0;
  LateJudge judge_;
  Span span_;
  std::vector<float> rows_, replay_t_, replay_body_, replay_hand_, replay_bends_;
  std::vector<std::uint64_t> replay_frames_;
  std::vector<std::vector<ReportContact>> contacts_;
  std::array<std::vector<float>, H6_STAGE_COUNT> stage_us_;
  std::vector<float> frame_us_;
  std::vector<LateFrame> late_frames_;
  std::map<std::uint64_t, double> again_us_;
  std::optional<TightestPlace> tightest_;
  std::vector<RecordingEvent> events_;
  double contacts_sum_ = 0, depth_max_ = 0, force_max_ = 0, end_ = 0;
  std::uint32_t contacts_max_ = 0;
  std::uint64_t hash_ = 0;
};

// `scene` gives the bodies; with nullptr the replay shows none, and `why` tells the reader the
// reason. Fails when this build has no pages, and when `runs` is empty.
Result<std::string> make_report(const std::vector<ReportRun>& runs, const LoadedScene* scene,
                                const std::string& why);

}  // namespace h6::io::view
