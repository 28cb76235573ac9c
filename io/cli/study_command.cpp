// SPDX-License-Identifier: Apache-2.0
// study_command.cpp - hapsix study: scenes run over ranges of their settings, a row for each run.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "hapsix/hapsix.h"
#include "io/cli/commands.h"
#include "io/console/checks.h"
#include "io/file/write_aside.h"
#include "io/run/try_run.h"
#include "io/scene/load_scene.h"
#include "io/study/parquet.h"
#include "io/study/picture.h"
#include "io/study/plan.h"
#include "io/study/scheduler.h"
#include "io/study/table.h"
#include "io/study/workers.h"

namespace h6::cli {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

struct Options {
  std::string file, folder;
  std::string scheduler;  // address
  std::size_t jobs = 0;
  bool worker = false;  // this process does runs for another
};

constexpr const char* kResults =
    "verdict,frames,contacts_max,contacts_mean,max_depth_voxels,final_depth_voxels,max_force,max_"
    "torque,"
    "first_contact,x,y,z,qw,qx,qy,qz,status,state_hash,error";

std::string header(const study::Plan& plan) {
  std::string out = "run,repeat";
  for (const std::string& key : plan.keys()) out += "," + study::csv_field(key);
  return out + "," + kResults;
}

std::string row_begin(const study::Plan& plan, std::size_t run) {
  std::string out = std::to_string(run) + "," + std::to_string(plan.repeat(run));
  for (const std::string& value : plan.values(run)) out += "," + study::csv_field(value);
  return out;
}

// The row of a run that gave nothing but a sentence.
std::string failed_row(const study::Plan& plan, std::size_t run, const std::string& why) {
  return row_begin(plan, run) + ",error,,,,,,,,,,,,,,,,,," + study::csv_field(why);
}

std::string number_field(double value) { return "," + Json(value).dump(); }

std::string result_row(const study::Plan& plan, std::size_t run, const Trial& trial) {
  const RunTotals& t = trial.totals;
  const double unit = plan.unit(run);
  std::string out = row_begin(plan, run) + "," + io::verdict_name(t.verdict);
  out += "," + std::to_string(t.frames) + "," + std::to_string(t.contacts_max);
  for (const double value :
       {t.contacts_mean, t.max_depth_voxels, t.final_depth_voxels, t.max_force, t.max_torque})
    out += number_field(value);
  out += trial.first_contact ? number_field(*trial.first_contact) : ",";
  const h6Pose& at = t.final_pose;
  for (const double value :
       {at.p.x / unit, at.p.y / unit, at.p.z / unit, at.q.w, at.q.x, at.q.y, at.q.z})
    out += number_field(value);
  char hash[24];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(t.state_hash));
  return out + "," + std::to_string(t.status) + "," + hash + ",";
}

std::string run_one(const study::Plan& plan, std::size_t run) {
  Result<io::Scene> scene = plan.scene(run);
  if (!scene) return failed_row(plan, run, scene.error());
  const Result<std::unique_ptr<io::LoadedScene>> loaded = io::load_scene(std::move(*scene));
  if (!loaded) return failed_row(plan, run, loaded.error());
  const Result<Trial> trial = try_run(**loaded);
  return trial ? result_row(plan, run, *trial) : failed_row(plan, run, trial.error());
}

// A row's last 18 columns, which begin with the verdict; "" where the run has no row yet. Names of
// scenes and values stand before them, and are no verdict whatever they say.
std::string results_of(const study::Plan& plan, const study::Table& table, std::size_t run) {
  const std::string& row = table.rows()[run];
  return row.substr(std::min(row_begin(plan, run).size() + 1, row.size()));
}

std::size_t errors_in(const study::Plan& plan, const study::Table& table) {
  std::size_t n = 0;
  for (std::size_t run = 0; run < plan.runs(); ++run)
    n += results_of(plan, table, run).rfind("error,", 0) == 0;
  return n;
}

void use_processes(const Program& program, const Options& o, study::Work& work) {
  work.command = {"hapsix", "study", o.file, "-o", o.folder, "--worker"};
  if (program.allow_outside) work.command.push_back("--allow-outside");
  work.processes = o.jobs ? o.jobs : std::max(1u, std::thread::hardware_concurrency());
}

Outcome do_runs(const Program& program, const Options& o, const study::Plan& plan,
                study::Table& table) {
  study::Work work;
  if (o.scheduler.empty()) {
    use_processes(program, o, work);
  } else {
    std::vector<std::string> job = {"study", o.file};
    for (const fs::path& scene : plan.scene_files()) job.push_back(scene.string());
    study::use_scheduler(o.scheduler, job, work);
  }
  for (std::size_t run = 0; run < plan.runs(); ++run)
    if (!table.has(run)) work.runs.push_back(run);
  work.processes = std::min(work.processes, work.runs.size());
  const io::Progress progress = program.console.progress();
  work.go_on = [&] {
    return progress("running",
                    static_cast<double>(table.done()) / static_cast<double>(plan.runs())) &&
           !interrupted.load();
  };
  work.done = [&](const std::string& row, double seconds) { return table.add(row, seconds); };
  work.lost = [&](std::size_t run, const std::string& why) { return failed_row(plan, run, why); };
  return work.runs.empty() ? Outcome(Done{}) : study::share_out(work);
}

Outcome draw(const Options& o, const study::Plan& plan, const study::Table& table) {
  std::vector<study::Seen> rows;
  for (std::size_t run = 0; run < plan.runs(); ++run) {
    std::stringstream rest(results_of(plan, table, run));
    std::string verdict, skipped, depth;
    std::getline(rest, verdict, ',');
    for (int i = 0; i < 3; ++i) std::getline(rest, skipped, ',');
    std::getline(rest, depth, ',');
    std::vector<std::string> values = plan.values(run);
    for (std::string& value : values)
      value.erase(std::remove(value.begin(), value.end(), '"'), value.end());
    rows.push_back(
        {std::move(values), verdict, depth.empty() ? NAN : std::strtod(depth.c_str(), nullptr)});
  }
  return io::write_text_aside(fs::path(o.folder) / "runs.svg",
                              study::picture(fs::path(o.file).stem().string(), plan.keys(), rows));
}

int report(const Console& console, const study::Plan& plan, const study::Table& table) {
  const std::size_t errors = errors_in(plan, table), runs = plan.runs();
  if (!console.json)
    std::printf("%zu runs, %zu of them failed: %s\n", runs, errors, table.file().c_str());
  console.result({{"runs", runs}, {"failed", errors}, {"table", table.file().string()}});
  if (errors == 0) return kOk;
  console.log("hapsix: " + std::to_string(errors) +
              " runs failed; the table's last column says why");
  return kFailed;
}

int study_command(const Program& program, const Options& o) {
  const Console& console = program.console;
  if (const Outcome good = check_input(o.file); !good) return console.fail(good.error());
  std::error_code error;
  const bool made = fs::create_directories(o.folder, error);
  if (!fs::is_directory(o.folder, error))
    return console.fail("cannot make the folder " + o.folder + ": " + error.message());
  const Result<study::Plan> plan = study::Plan::read(o.file, o.folder, program.allow_outside);
  if (!plan) {
    if (made) fs::remove_all(o.folder, error);  // nothing of the user is in it
    return console.fail(plan.error());
  }
  if (o.worker) return study::serve([&](std::size_t run) { return run_one(*plan, run); }), kOk;
  Result<study::Table> table =
      study::Table::open(o.folder, plan->identity(), header(*plan), plan->runs());
  if (!table) return console.fail(table.error());
  if (table->done() > 0)
    console.log("hapsix: " + std::to_string(table->done()) + " of " + std::to_string(plan->runs()) +
                " runs are done already");
  if (const Outcome done = do_runs(program, o, *plan, *table); !done)
    return console.fail(done.error());
  if (table->done() < plan->runs())
    return console.fail("interrupted after " + std::to_string(table->done()) + " of " +
                        std::to_string(plan->runs()) + " runs; the same command goes on");
  if (const Outcome finished = table->finish(); !finished) return console.fail(finished.error());
  if (const Outcome drawn = draw(o, *plan, *table); !drawn) return console.fail(drawn.error());
  const fs::path parquet = fs::path(table->file()).replace_extension(".parquet");
  if (const Result<bool> packed = study::write_parquet(table->file(), parquet); !packed)
    console.warn({"the table is CSV only: " + packed.error()});
  return report(console, *plan, *table);
}

}  // namespace

void add_study(CLI::App& app, Program& program) {
  CLI::App* command = app.add_subcommand(
      "study",
      "A scene, or several, over ranges of their settings, in several processes: a row of a table "
      "for each run");
  auto o = std::make_shared<Options>();
  command->add_option("STUDY.json", o->file, "Scenes and what varies; see below")->required();
  command
      ->add_option("-o,--output", o->folder,
                   "Its folder: runs.csv, times.csv (seconds of each run) and runs.svg in the end, "
                   "and runs.parquet where Python has pyarrow. A study that was killed goes on "
                   "where it was")
      ->required()
      ->option_text("FOLDER");
  command->add_option("--jobs", o->jobs, "Processes; default: one for each core")
      ->check(whole_within(1, 1024))
      ->option_text("N");
  command
      ->add_option("--scheduler", o->scheduler,
                   "Do the runs on the workers of this scheduler of Dask's distributed; the same "
                   "table, as far as they have this machine's SIMD target")
      ->option_text("ADDRESS")
      ->excludes("--jobs");
  command->add_flag("--worker", o->worker)->group("");
  command->footer(
      "STUDY.json: {\"hapsix_study\": 1, \"scene\": \"peg-in-hole\",\n"
      "  \"vary\": {\"contact.method\": [\"firm\", \"global\"],\n"
      "           \"bodies.block.field.offset\": {\"from\": 0, \"to\": 0.4, \"count\": 5}},\n"
      "  \"draw\": {\"bodies.peg.pose.p.x\": {\"low\": -0.2, \"high\": 0.2}}, \"repeats\": "
      "20}\n"
      "\"scene\" may be a list of scenes, each of which then has all of these runs.\n\n" +
      command->get_footer());
  command->callback(
      [&program, o] { program.work = [&program, o] { return study_command(program, *o); }; });
}

}  // namespace h6::cli
