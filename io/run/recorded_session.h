// SPDX-License-Identifier: Apache-2.0
// recorded_session.h - runs a recording again. With the scene, the settings and the SIMD target of
// the recording, the recorded hand samples give the same frames.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"
#include "io/record/recording.h"
#include "io/run/recorded_run.h"
#include "io/run/run_setup.h"
#include "io/scene/load_scene.h"

namespace h6::cli {

class RecordedSession {
 public:
  // Differences from the recording. An empty or zero member changes nothing.
  struct Changes {
    std::string method;
    unsigned threads = 0;
  };
  // Reads the head, the events and the column names of `recording`, not its frames. Fails if the
  // recording does not say how it was run, or if a part of its scene is missing or has changed.
  // `remarks` gets messages for the user, whether it fails or not.
  static Result<std::unique_ptr<RecordedSession>> open(const std::filesystem::path& file,
                                                       const io::Recording& recording,
                                                       const Changes& changes,
                                                       const io::Progress& progress,
                                                       std::vector<std::string>& remarks);
  // Computes a recorded frame again. Pass all rows in order, from the first one. The result is
  // valid until the next call. Fails if settings were changed and the recording does not say how or
  // when.
  Result<const h6FrameRecord*> step(const h6FrameRecord& recorded);

  // q of all bodies that bend after the last step, one body after another [m sqrt(kg)].
  const std::vector<double>& bends() const { return now_bends_; }

  const io::LoadedScene& loaded() const { return *loaded_; }
  const io::RecordedRun& run() const { return run_; }
  const h6Session* session() const { return session_.get(); }
  unsigned threads() const { return threads_; }
  const std::string& method() const { return method_; }
  const std::string& recorded_method() const { return recorded_method_; }

 private:
  RecordedSession() = default;
  void set_faults(const h6FrameRecord& recorded);
  void hold_back(const h6FrameRecord& recorded);
  Outcome follow_settings(const h6FrameRecord& recorded);
  Outcome change_settings(const std::string& detail);
  io::RecordedRun run_;
  std::unique_ptr<io::LoadedScene> loaded_;
  h6SessionDef def_{};
  std::vector<h6HandDef> hand_defs_;
  std::vector<io::RecordingEvent> settings_;  // the "settings" events, in order
  std::uint32_t changed_ = 0;                 // how many of `settings_` are applied
  bool own_method_ = false;                   // the caller chose the method
  bool has_inputs_ = false, says_when_ = false;
  SessionPtr session_;
  std::size_t hands_ = 0;
  unsigned threads_ = 1;
  std::string method_, recorded_method_;
  bool latched_ = false;
  h6Pose sent_[H6_MAX_HANDS] = {};  // the poses of the recorded commands before
  bool any_sent_ = false;
  h6FrameRecord now_{};
  std::vector<io::RecordedBend> bends_;
  std::vector<double> now_bends_;
};

}  // namespace h6::cli
