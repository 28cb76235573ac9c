// SPDX-License-Identifier: Apache-2.0
// view_run.h - a run with a live page: `hapsix run SCENE --view`.
//
// The page's server has a thread of its own, and the run has the haptic thread. The program's
// thread connects them: it sends rows and contacts to the page 60 times a second and forwards the
// page's requests. A reset or a recording restarts the run; other settings do not.
#pragma once
#include <functional>
#include <string>

#include "io/run/run_scene.h"

namespace CLI {
class App;
}

namespace h6::cli {

struct ViewOptions {
  bool on = false;
  int port = 0;              // 0: any free port
  bool open = true;          // opens a browser, if there is a screen
  std::string folder = ".";  // for recordings that the page starts
};

// Adds --view, --port and --no-browser. `view` must live until the program has parsed.
void add_view_options(CLI::App& command, ViewOptions& view);

// Runs until the user ends it or `options.duration` is over. `done` gets each run's summary.
Outcome view_scene(const io::LoadedScene& scene, const RunOptions& options, const ViewOptions& view,
                   const Console& console, const std::function<void(const RunSummary&)>& done);

}  // namespace h6::cli
