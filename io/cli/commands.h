// SPDX-License-Identifier: Apache-2.0
// commands.h - one function for each subcommand: it adds the command; the work runs after parsing.
#pragma once
#include <functional>

#include "io/console/console.h"

namespace CLI {
class App;
}

namespace h6::cli {

// The work of the chosen subcommand; returns the program's exit code.
struct Program {
  Console console;
  bool allow_outside = false;  // scene files may name files outside their folder
  std::function<int()> work;
};

void add_new(CLI::App& app, Program& program);
void add_bake(CLI::App& app, Program& program);
void add_export(CLI::App& app, Program& program);
void add_report(CLI::App& app, Program& program);
void add_run(CLI::App& app, Program& program);
void add_check(CLI::App& app, Program& program);
void add_replay(CLI::App& app, Program& program);
void add_info(CLI::App& app, Program& program);
void add_devices(CLI::App& app, Program& program);
void add_scene(CLI::App& app, Program& program);
void add_demo(CLI::App& app, Program& program);
void add_experiments(CLI::App& app, Program& program);
void add_map(CLI::App& app, Program& program);
void add_study(CLI::App& app, Program& program);

}  // namespace h6::cli
