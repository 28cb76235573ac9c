// SPDX-License-Identifier: Apache-2.0
// demo_command.cpp - hapsix demo: forces the alpha puzzle through its gap in real time, with global
// scaling and with the adaptive weights.
#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "io/cli/commands.h"
#include "io/cli/report_files.h"
#include "io/cli/tables.h"
#include "io/cli/view_run.h"
#include "io/console/checks.h"
#include "io/run/run_scene.h"
#include "io/scenes/scenes.h"
#include "io/view/page.h"

namespace h6::cli {
namespace {

struct DemoOptions {
  std::string scene = "alpha-shortcut", folder = "hapsix-demo";
  RunOptions run;
  ViewOptions view;
};

void print(const std::vector<RunSummary>& runs, bool virtual_time) {
  std::printf("\n%s", table(runs).c_str());
  for (const RunSummary& run : runs)
    std::printf("\ndeepest contact over time, %s [voxel]\n%s", run.method.c_str(),
                depth_strip(run).c_str());
  if (!virtual_time) std::printf("\nreal time: %s\n", runs.back().loop.granted);
  for (const RunSummary& run : runs)
    std::printf("recording: %s\n", printable(run.recording).c_str());
}

// Writes the report. A program built without the page's files writes none, but the demo still runs.
Outcome report(const Console& console, const DemoOptions& o, const std::vector<RunSummary>& runs,
               nlohmann::ordered_json& json) {
  if (io::view::report_page().empty()) return Done{};
  std::vector<std::string> recordings;
  for (const RunSummary& run : runs) recordings.push_back(run.recording);
  const std::string file = (std::filesystem::path(o.folder) / (o.scene + ".html")).string();
  const Result<std::size_t> written = write_report(recordings, file, console);
  if (!written) return written.failure();
  json["report"] = file;
  if (!console.json) std::printf("report: %s\n", file.c_str());
  return Done{};
}

int demo_command(const Console& console, DemoOptions o) {
  if (o.view.on && o.run.virtual_time)
    return console.fail("--view shows a run in real time: leave --virtual-time out", kUsage);
  Result<io::Scene> scene = io::make_scene(o.scene);
  if (!scene) return console.fail(scene.error(), kUsage);
  std::error_code failed;
  std::filesystem::create_directories(o.folder, failed);
  if (failed)
    return console.fail("the folder " + o.folder + " cannot be made (" + failed.message() +
                        "): choose another with -o");
  console.log(scene->about + "\n");
  auto loaded = [&] {
    const EndsAtOnce asked(console, o.scene + ": cancelled");
    return io::load_scene(std::move(*scene), console.progress());
  }();
  if (!loaded) return console.fail(loaded.error());
  console.warn((*loaded)->warnings);
  console.log(assets(**loaded));
  std::vector<RunSummary> runs;
  nlohmann::ordered_json json{{"scene", o.scene}, {"runs", nlohmann::ordered_json::array()}};
  for (const char* method : {"global", "firm"}) {
    o.run.method = method;
    o.run.record = (std::filesystem::path(o.folder) / (o.scene + "-" + method + ".h5")).string();
    console.log("running " + o.scene + " with '" + method + "' for " +
                number(o.run.duration > 0 ? o.run.duration : (*loaded)->duration(), 1) + " s" +
                (o.run.virtual_time
                     ? " of virtual time"
                     : " in real time at " + number((*loaded)->scene.rate, 0) + " Hz"));
    Result<RunSummary> summary = run_scene(**loaded, o.run, console);
    if (!summary) return console.fail(summary.error());
    json["runs"].push_back(to_json(*summary, **loaded, o.run.virtual_time));
    runs.push_back(std::move(*summary));
    if (runs.back().interrupted) return console.fail("interrupted");
  }
  if (!console.json) print(runs, o.run.virtual_time);
  if (Outcome reported = report(console, o, runs, json); !reported)
    return console.fail(reported.error());
  if (o.view.on) {
    o.view.folder = o.folder;
    o.run = {};  // the run is endless, uses the scene's own settings and records only on request
    const Outcome viewed = view_scene(**loaded, o.run, o.view, console, [](const RunSummary&) {});
    if (!viewed) return console.fail(viewed.error());
  }
  console.result(json);
  return kOk;
}

}  // namespace

void add_demo(CLI::App& app, Program& program) {
  CLI::App* demo = app.add_subcommand(
      "demo", "The alpha puzzle forced through its gap, two methods side by side");
  auto o = std::make_shared<DemoOptions>();
  demo->add_option("--scene", o->scene, "Another generated scene; default alpha-shortcut")
      ->option_text("NAME");
  demo->add_option("-o,--output", o->folder, "Folder for the recordings; default hapsix-demo")
      ->option_text("FOLDER");
  demo->add_option("--duration", o->run.duration, "Of each run; default: as the scene says")
      ->option_text("SECONDS")
      ->check(number_within(1e-3, 1e6));
  demo->add_flag("--virtual-time", o->run.virtual_time,
                 "As fast as possible instead of in real time");
  demo->add_option("--threads", o->run.threads,
                   "1 (default): the haptic thread alone; N: with N - 1 helpers")
      ->option_text("N")
      ->check(whole_within(1, 64));
  add_view_options(*demo, o->view);
  demo->callback([&program, o] {
    program.work = [&program, o] { return demo_command(program.console, *o); };
  });
}

}  // namespace h6::cli
