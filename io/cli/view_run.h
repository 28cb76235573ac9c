// SPDX-License-Identifier: Apache-2.0
// view_run.h - a run that is looked at: `hapsix run SCENE --view`.
//
// The page's server is on a thread of its own, the run on the haptic thread; between them this,
// on the program's thread: rows and contacts out, 60 pictures a second; wishes of the page in. A
// reset or a recording begins the run again; other settings do not.
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
  int port = 0;              // 0: any free one
  bool open = true;          // a browser, where there is a screen
  std::string folder = ".";  // for what is recorded from the page
};

// --view, --port, --no-browser. What they are kept in must live until the program has parsed.
void add_view_options(CLI::App& command, ViewOptions& view);

// Runs until the user ends it, or until `options.duration`. `done` gets each run's summary.
Outcome view_scene(const io::LoadedScene& scene, const RunOptions& options, const ViewOptions& view,
                   const Console& console, const std::function<void(const RunSummary&)>& done);

}  // namespace h6::cli
