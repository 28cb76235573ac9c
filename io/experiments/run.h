// SPDX-License-Identifier: Apache-2.0
// run.h - runs a scene in virtual time on the calling thread, measures the figures of the tables,
// and runs independent jobs on two threads.
#pragma once
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/console/console.h"
#include "io/run/run_setup.h"
#include "io/run/run_tally.h"
#include "io/scene/load_scene.h"

namespace h6::cli {

// A column of the tables: a weight method, its options and, for `global`, its n0.
struct MethodColumn {
  std::string name;      // in tables and JSON
  std::string method;    // a name for h6MethodFromName
  double global_n0 = 0;  // 0: the scene's
  void apply(h6ContactDef& contact) const;
};
// Every method of the engine. The paper's two Gauss methods also come with the facing filter, and
// `global` also comes with n0 = 1, which gives the Gauss methods' net stiffness on a flat wall.
std::vector<MethodColumn> method_columns();
// The columns of these names, separated by commas, each once; all for an empty list.
Result<std::vector<MethodColumn>> columns_named(const std::string& list);

struct RunChange {
  MethodColumn method;
  double force = 1;      // multiple of the coupling's stiffness and bounds
  double stiffness = 0;  // of the contacts, 0: the scene's [N/m]
  double damping = -1;   // of the contacts, < 0: the scene's [s]
  int integrator = -1;   // < 0: the scene's
  double rate = 0;       // 0: the scene's [Hz]
  // The coupling's largest force [N]. 0: the engine derives it from max_depth_voxels; < 0: the
  // scene's.
  double max_force = -1;
  const io::Path* path = nullptr;   // of the first hand, null: the scene's
  std::string device = "path";      // of every hand, as `hapsix run --device` takes it
  std::optional<io::SceneArm> arm;  // of every hand, none: the scene's
  // Called last, once for every hand, to change anything else in the definitions.
  std::function<void(h6SessionDef&, h6HandDef&)> also;
  std::string record;  // .h5 file, empty: none
  // Called after every frame with the contacts of the first hand's body; they may be empty.
  std::function<void(const h6FrameRecord&, const h6Contacts&)> each;
};

// The deepest contact of a run: which triangle stopped which point.
struct Deepest {
  double depth = 0;            // [m]; 0: nothing touched
  std::uint32_t point = 0;     // of the shell
  std::uint32_t triangle = 0;  // of the obstacle's mesh: the nearest to that point
  std::string obstacle, part;  // the body and the mesh's part; empty where nothing knows them
};

struct RunFigures : RunTotals {
  double frame_us_p50 = 0, frame_us_p99 = 0;
  std::array<double, H6_STAGE_COUNT> stage_us_p50{};
  Deepest deepest;            // of the first hand's body
  bool torque_noise = false;  // the weights had a torque direction that is rounding noise: r is
                              // parallel to N, and the rule uses r x N made unit
  std::string error;          // why the run failed; empty when it did not
  bool moved_on() const {     // the paper counts such a run as held
    return error.empty() && (verdict == io::Verdict::held || verdict == io::Verdict::untouched ||
                             verdict == io::Verdict::arrived);
  }
};

RunFigures run_experiment(const io::LoadedScene& loaded, const RunChange& change);

// Total wrench of a body's contacts [N, N m]: the sum of k load N, where `load` is the contacts'.
// It is the elastic part; under `series` the loads include the effect of contact damping.
h6Wrench elastic_wrench(const h6Contacts& contacts, double stiffness);

// Runs independent jobs on some threads; ends early once the user interrupts. The progress bar
// shows `label` and the share of jobs done. An exception of a job is rethrown here.
void run_jobs(const std::vector<std::function<void()>>& jobs, const Console& console,
              const std::string& label, int threads = 2);

}  // namespace h6::cli
