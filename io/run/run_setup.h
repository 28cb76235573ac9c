// SPDX-License-Identifier: Apache-2.0
// run_setup.h - sets up a run of a loaded scene, in real time or not: a session, the devices of its
// hands and a recording.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "device/steering.h"
#include "hapsix/result.h"
#include "io/record/recording.h"
#include "io/run/hands.h"
#include "io/run/start_overlap.h"
#include "io/scene/load_scene.h"

namespace h6::cli {

struct SessionRelease {
  void operator()(h6Session* session) const { h6DestroySession(session); }
};
using SessionPtr = std::unique_ptr<h6Session, SessionRelease>;

// The bodies of a scene that bend, as a recording names them.
std::vector<io::RecordedBend> recorded_bends(const io::LoadedScene& loaded);
// Their q now, one body after another, appended to `out` [m sqrt(kg)].
void append_bends(const h6Session* session, const std::vector<io::RecordedBend>& bends,
                  std::vector<double>& out);

// A run in preparation. Change `def`, `hand_defs` and `hands` as needed, then call open().
struct RunSetup {
  explicit RunSetup(const io::LoadedScene& scene);
  RunSetup(const RunSetup&) = delete;  // def points at hand_defs
  RunSetup& operator=(const RunSetup&) = delete;

  const io::LoadedScene& loaded;
  h6SessionDef def;
  std::vector<h6HandDef> hand_defs;
  std::vector<io::SceneHand> hands;  // devices, paths and arms; open() uses hand_defs, not `def`
  std::string record;                // .h5 file of the recording; empty for none
  std::shared_ptr<device::Steering> steering;  // may take the first hand off its path
  bool virtual_time = true;                    // for the recording's head

  SessionPtr session;
  std::vector<PartOverlap> overlaps;  // at the start
  Hands devices;
  std::unique_ptr<io::Recorder> recorder;
  // Fails for parts that start too deep in one another (check_start).
  Outcome open();
  // Computes the frame at r.time on this thread, as the haptic loop does, and fills the rest of
  // `r`.
  Outcome step(h6FrameRecord& r);

 private:
  Outcome open_recording();
};

}  // namespace h6::cli
