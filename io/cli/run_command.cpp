// SPDX-License-Identifier: Apache-2.0
// run_command.cpp - hapsix run SCENE.json: runs a scene and prints forces and a verdict.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "device/device_spec.h"
#include "io/cli/commands.h"
#include "io/cli/tables.h"
#include "io/cli/view_run.h"
#include "io/console/checks.h"
#include "io/mesh/mesh_file.h"
#include "io/run/hands.h"
#include "io/run/run_scene.h"
#include "io/run/start_warnings.h"
#include "io/scene/scene_file.h"
#include "io/scenes/scenes.h"

namespace h6::cli {
namespace {

// Reads a scene file, or makes the generated scene of that name. Sets the exit code of a failure.
Result<io::Scene> find_scene(const std::string& name, bool outside, int* code) {
  std::vector<std::string> known;
  for (const io::SceneName& scene : io::scene_names()) known.push_back(scene.name);
  const bool is_name = std::find(known.begin(), known.end(), name) != known.end();
  // 'hapsix scene export NAME NAME' leaves a folder of that name, which is no scene file.
  const bool is_file =
      std::filesystem::exists(name) && !(is_name && std::filesystem::is_directory(name));
  if (!is_file && is_name) return io::make_scene(name);
  if (!is_file && std::filesystem::path(name).extension() != ".json") {  // the user meant a name
    const std::string like = nearest(name, known);
    *code = kUsage;
    return Failure{"there is neither a file nor a generated scene '" + name + "'" +
                   (like.empty() ? "; 'hapsix scene list' shows what there is"
                                 : ", did you mean '" + like + "'?")};
  }
  if (Outcome there = check_input(name); !there) return there.failure();
  return io::read_scene(name, outside);
}

// A scene may come from a stranger: the script or recording that it names as a hand lies below its
// folder.
Outcome stays_inside(const io::Scene& scene, const io::SceneHand& hand, bool outside) {
  if (outside || scene.file.empty()) return Done{};
  const Result<device::DeviceSpec> spec = device::parse_device_spec(hand.device);
  if (!spec) return spec.failure();
  if (spec->target.empty() || io::lies_below(spec->target, scene.file)) return Done{};
  return Failure{"hand of '" + hand.body + "': \"" + spec->target +
                 "\" lies outside the folder of the scene file: move it there, or give "
                 "--allow-outside if you trust the scene"};
}

// The user gave meshes where a scene belongs: says how a scene is made of them. The smaller one is
// taken for the part.
std::string mesh_sentence(std::vector<std::string> names) {
  const auto size = [](const std::string& name) {
    const Result<io::Mesh> mesh = io::read_mesh(name);
    return mesh ? io::bounds_of(*mesh).longest() : 0;
  };
  if (names.size() == 2 && size(names[1]) < size(names[0])) std::swap(names[0], names[1]);
  std::string command = "hapsix new", meshes;
  for (const std::string& name : names) command += " " + name;
  if (names.size() == 1) command += " ENVIRONMENT";
  return "'" + names[0] + "' is a mesh, and run needs a scene: '" + command +
         "' makes one of a part and what it touches, and shows it";
}

// An empty text unless one of the names is a mesh.
std::string about_names(const std::vector<std::string>& names) {
  if (std::any_of(names.begin(), names.end(), io::is_mesh_name)) return mesh_sentence(names);
  return names.size() == 1 ? ""
                           : "'" + names[1] + "' is one argument too many: run takes one scene";
}

int run_command(const Console& console, const std::vector<std::string>& names,
                const RunOptions& options, const ViewOptions& view, bool outside) {
  if (const std::string wrong = about_names(names); !wrong.empty())
    return console.fail(wrong, kUsage);
  const std::string& name = names[0];
  if (view.on && options.virtual_time)
    return console.fail("--view shows a run in real time: leave --virtual-time out", kUsage);
  if (Outcome known = check_options(options); !known) return console.fail(known.error(), kUsage);
  if (Outcome there = check_device_file(options.device); !there) return console.fail(there.error());
  for (const std::string& file : {options.record, options.trace, options.overlap})
    if (!file.empty())
      if (Outcome place = check_output(file); !place) return console.fail(place.error());
  int code = kFailed;
  Result<io::Scene> scene = find_scene(name, outside, &code);
  if (!scene) return console.fail(scene.error(), code);
  if (options.device.empty())
    for (const io::SceneHand& hand : scene->hands) {
      if (Outcome known = check_device(hand.device); !known)
        return console.fail(name + ": hand of '" + hand.body + "': " + known.error());
      if (hand.device.rfind("plugin:", 0) ==
          0)  // a plug-in is code, and the scene may come from a stranger
        return console.fail(name + ": hand of '" + hand.body +
                            "': a scene does not load plug-ins by itself, give it with --device");
      if (Outcome near = stays_inside(*scene, hand, outside); !near)
        return console.fail(name + ": " + near.error());
    }
  auto loaded = [&] {
    const EndsAtOnce asked(console, name + ": cancelled");
    return io::load_scene(std::move(*scene), console.progress());
  }();
  if (!loaded) return console.fail(name + ": " + loaded.error());
  console.warn((*loaded)->warnings);
  console.warn(start_warnings(**loaded, options.device));
  if (!console.json) console.log(assets(**loaded));
  Result<RunSummary> summary = Failure{"nothing was run"};
  if (view.on) {
    const Outcome viewed = view_scene(**loaded, options, view, console,
                                      [&](const RunSummary& last) { summary = last; });
    if (!viewed) return console.fail(name + ": " + viewed.error());
  } else {
    summary = run_scene(**loaded, options, console);
  }
  if (!summary) return console.fail(name + ": " + summary.error());
  const std::string stopped =
      "interrupted after " + std::to_string(summary->loop.frames) + " frames";
  nlohmann::ordered_json json = to_json(*summary, **loaded, options.virtual_time);
  if (summary->interrupted) json["error"] = stopped;  // the figures cover the run up to that point
  console.result(json);
  if (!console.json) {
    std::printf("%s\ndeepest contact over time [voxel]\n%s", table({*summary}).c_str(),
                depth_strip(*summary).c_str());
    if (const auto& entry = summary->forbidden) {
      const h6Vec3 p = (1 / io::metres((*loaded)->scene.unit)) * entry->place;
      std::printf(
          "the part was in a forbidden region, first at %.3f s, with a point at (%g, %g, %g) %s\n",
          entry->time, p.x, p.y, p.z, io::unit_name((*loaded)->scene.unit));
    }
    for (const std::string& remark : remarks(*summary))
      std::printf("%s\n", printable(remark).c_str());
    if (const std::string late = late_table(*summary); !late.empty())
      std::printf("\n%s", late.c_str());
    if (!options.virtual_time) std::printf("\nreal time: %s\n", summary->loop.granted);
    if (!options.record.empty()) std::printf("recording: %s\n", printable(options.record).c_str());
    if (!options.trace.empty()) std::printf("timeline: %s\n", printable(options.trace).c_str());
    if (!options.overlap.empty()) std::printf("overlap: %s\n", printable(options.overlap).c_str());
  }
  if (!summary->interrupted) return kOk;
  console.log("hapsix: " + stopped);
  return kFailed;
}

}  // namespace

void add_run(CLI::App& app, Program& program) {
  CLI::App* run = app.add_subcommand("run", "Run a scene: forces and a verdict out");
  auto name = std::make_shared<std::vector<std::string>>();
  auto o = std::make_shared<RunOptions>();
  auto view = std::make_shared<ViewOptions>();
  run->add_option("SCENE", *name,
                  "A scene file, or the name of a generated scene ('hapsix scene list')")
      ->required()
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->option_text("FILE|NAME");
  run->add_option("--device", o->device,
                  "For every hand: path (follows the scene's path exactly), simulated (a person "
                  "who yields), arm (a simulated force-feedback arm that a person holds), "
                  "spacemouse, plugin:FILE, ... ('hapsix devices' shows all)")
      ->option_text("NAME");
  run->add_option("--duration", o->duration, "Default: as the scene says")
      ->option_text("SECONDS")
      ->check(number_within(1e-3, 1e6));
  run->add_flag("--virtual-time", o->virtual_time,
                "As fast as possible instead of in real time; same code, same bits");
  run->add_option(
         "--method", o->method,
         "none, global, cluster, gauss3, gauss6, robust, series or firm; the Gauss ones also with "
         "+facing, +depth, +product, +cluster, +geodesic, +handles, +printed")
      ->option_text("NAME");
  run->add_option("--threads", o->threads,
                  "1 (default): the haptic thread alone; N: with N - 1 helpers; same bits")
      ->option_text("N")
      ->check(whole_within(1, 64));
  run->add_option("--spin", o->spin_us,
                  "Poll the clock for this long before each deadline; default 0")
      ->option_text("MICROSECONDS")
      ->check(number_within(0, 10000));
  run->add_option(
         "--budget", o->budget_us,
         "Anytime mode: a frame that would take longer makes do with 8, 4, 2 or 1 points of "
         "sixteen; not in virtual time; default off")
      ->option_text("MICROSECONDS")
      ->check(number_within(0, 1000000));
  run->add_option("--rearm", o->rearm,
                  "Arm hands again so long after a fault has latched their output; simulated hands "
                  "only; default never")
      ->option_text("SECONDS")
      ->check(number_within(1e-3, 1e6));
  run->add_option("--record", o->record, "Record every frame to this .h5 file")
      ->option_text("FILE")
      ->check(ends_with(".h5"));
  run->add_option("--trace", o->trace,
                  "A timeline of the last ten seconds, every stage of every frame, for "
                  "ui.perfetto.dev or chrome://tracing")
      ->option_text("FILE.json")
      ->check(ends_with(".json"));
  run->add_option("--overlap", o->overlap,
                  "The points that are inside another part at the start, one a row")
      ->option_text("FILE.csv")
      ->check(ends_with(".csv"));
  add_view_options(*run, *view);
  run->callback([&program, name, o, view] {
    program.work = [&program, name, o, view] {
      return run_command(program.console, *name, *o, *view, program.allow_outside);
    };
  });
}

}  // namespace h6::cli
