// SPDX-License-Identifier: Apache-2.0
// run.h - runs a scene in virtual time on the calling thread and measures the figures of the
// tables; runs independent pieces of work side by side.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/console/console.h"
#include "io/run/run_setup.h"
#include "io/run/run_tally.h"
#include "io/scene/load_scene.h"

namespace h6::cli {

// A column of the tables: a weight method with its pieces and, for `global`, its n0.
struct MethodColumn {
  std::string name;      // in tables and JSON
  std::string method;    // as h6MethodFromName takes it
  double global_n0 = 0;  // 0: the scene's
  void apply(h6ContactDef& contact) const;
};
// Every method that the engine has, the paper's two also with the facing filter, and `global` also
// with n0 = 1, the Gauss methods' net stiffness on a flat wall.
std::vector<MethodColumn> method_columns();

struct RunChange {
  MethodColumn method;
  double force = 1;                 // multiple of the coupling's stiffness and bounds
  double stiffness = 0;             // of contacts, 0: the scene's [N/m]
  double damping = -1;              // of contacts, < 0: the scene's [s]
  int integrator = -1;              // < 0: the scene's
  double rate = 0;                  // 0: the scene's [Hz]
  double max_force = -1;            // of the coupling [N]; 0: half a voxel's, < 0: the scene's
  const io::Path* path = nullptr;   // of the first hand, null: the scene's
  std::string device = "path";      // of every hand, as `hapsix run --device` takes it
  std::optional<io::SceneArm> arm;  // of every hand, none: the scene's
  // Called last on the definitions, once for every hand: modes, filters, ...
  std::function<void(h6SessionDef&, h6HandDef&)> also;
  std::string record;  // .h5 file, empty: none
};

struct RunFigures : RunTotals {
  double frame_us_p50 = 0, frame_us_p99 = 0;
  std::string error;       // why the run failed; empty when it did not
  bool moved_on() const {  // what a scene of the paper calls held
    return error.empty() && (verdict == io::Verdict::held || verdict == io::Verdict::arrived);
  }
};

RunFigures run_experiment(const io::LoadedScene& loaded, const RunChange& change);

// Total wrench of a body's contacts from their loads: elastic, under `series` with what damping
// takes. Sum of k load N [N], [N m].
h6Wrench elastic_wrench(const h6Contacts& contacts, double stiffness);

// Independent pieces of work on two threads; ends early once the user interrupts. `label` and the
// share done go to the progress bar.
void run_jobs(const std::vector<std::function<void()>>& jobs, const Console& console,
              const std::string& label);

}  // namespace h6::cli
