// SPDX-License-Identifier: Apache-2.0
// map_command.cpp - hapsix map: how robust the weight methods are, over many variations of every
// scene.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <sstream>

#include "io/cli/commands.h"
#include "io/console/checks.h"
#include "io/experiments/map/kept_map.h"
#include "io/experiments/map/map_page.h"
#include "io/file/write_aside.h"
#include "io/study/scheduler.h"

namespace h6::cli {
namespace {

struct Options {
  std::string methods, scenes, only, csv, report, keep, scheduler;
  bool worker = false;
  MapOptions map;
};

// `robust` comes first, because the others are compared with it.
Outcome choose_methods(const std::string& list, std::vector<MethodColumn>& out) {
  Result<std::vector<MethodColumn>> wanted = columns_named("robust," + list);
  if (!wanted) return Failure{wanted.error()};
  out = std::move(*wanted);
  return Done{};
}

Outcome choose(Options& o) {
  if (o.methods.empty())
    o.map.methods = map_methods();
  else if (Outcome chosen = choose_methods(o.methods, o.map.methods); !chosen)
    return chosen;
  std::stringstream in(o.scenes);
  for (std::string word; std::getline(in, word, ',');) o.map.scenes.push_back(word);
  if (!o.only.empty()) {
    const std::size_t colon = o.only.find(':');
    const std::string index = colon == std::string::npos ? "" : o.only.substr(colon + 1);
    if (!whole_within(0, 999999)(index).empty())
      return Failure{"--only " + must_be("SCENE:INDEX such as cone-in-gap:3", o.only)};
    o.map.scenes = {o.only.substr(0, colon)};
    o.map.only = std::stoul(index);
    o.map.variations = *o.map.only + 1;
  }
  const std::vector<std::string> known = map_scene_names();
  for (const std::string& name : o.map.scenes)
    if (std::find(known.begin(), known.end(), name) == known.end())
      return Failure{no_such("scene", name, known)};
  return Done{};
}

// The arguments with which a worker draws the same variations.
std::vector<std::string> words_of(const Options& o) {
  std::vector<std::string> out = {"map", "--variations", std::to_string(o.map.variations), "--seed",
                                  std::to_string(o.map.seed)};
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) out.insert(out.end(), {option, value});
  };
  add("--methods", o.methods), add("--scenes", o.scenes), add("--only", o.only);
  return out;
}

void serve_map(const MapOptions& options) {
  MapPlan plan = plan_map(options);
  study::serve([&](std::size_t job) {
    if (job >= plan.jobs.size())
      return std::string("!a worker is asked for a variation that its map does not have");
    run_job(options, plan, job);
    return std::to_string(job) + " " + job_line(plan, job);
  });
}

Outcome map_on_scheduler(const Options& o, const Console& console, MapPlan& plan, KeptMap& kept) {
  study::Work work;
  study::use_scheduler(o.scheduler, words_of(o), work);
  for (std::size_t job = 0; job < plan.jobs.size(); ++job)
    if (is_open(plan, job)) work.runs.push_back(job);
  std::size_t done = plan.jobs.size() - work.runs.size();
  const io::Progress progress = console.progress();
  work.go_on = [&] {
    return progress("variations",
                    static_cast<double>(done) / static_cast<double>(plan.jobs.size())) &&
           !interrupted.load();
  };
  work.done = [&](const std::string& line, double seconds) -> Outcome {
    std::size_t end = 0;
    const std::size_t job = std::stoul(line, &end);
    if (!take_job_line(plan, job, line.substr(end)))
      return Failure{"a worker gave no runs: " + line.substr(0, 100)};
    ++done;
    return kept.add(plan, job, seconds);
  };
  work.lost = [&](std::size_t job, const std::string& why) {
    MapPlan::Job& lost = plan.jobs[job];
    plan.scenes[lost.scene].variations[lost.variation].error = why;
    return std::to_string(job) + " " + job_line(plan, job);
  };
  return work.runs.empty() ? Outcome(Done{}) : study::share_out(work);
}

Result<std::vector<MapScene>> map_scenes(const Options& o, const Console& console) {
  MapPlan plan = plan_map(o.map);
  KeptMap kept;
  if (!o.keep.empty()) {
    const Outcome opened = kept.open(o.keep, words_of(o), plan);
    if (!opened) return opened.failure();
    if (kept.done() > 0)
      console.log("hapsix: " + std::to_string(kept.done()) + " of " +
                  std::to_string(plan.jobs.size()) + " variations are done already");
  }
  const Outcome ran = o.scheduler.empty() ? run_open_jobs(o.map, plan, console,
                                                          [&](std::size_t job, double seconds) {
                                                            return kept.add(plan, job, seconds);
                                                          })
                                          : map_on_scheduler(o, console, plan, kept);
  if (!ran) return ran.failure();
  if (interrupted.load())
    return Failure{o.keep.empty() ? "interrupted" : "interrupted; the same command goes on"};
  if (const Outcome finished = kept.finish(); !finished) return finished.failure();
  return finish_map(std::move(plan));
}

int map_command(const Console& console, Options& o) {
  if (Outcome chosen = choose(o); !chosen) return console.fail(chosen.error(), kUsage);
  if (o.worker) return serve_map(o.map), kOk;
  for (const std::string& file : {o.csv, o.report})
    if (Outcome good = file.empty() ? Outcome(Done{}) : check_output(file); !good)
      return console.fail(good.error());
  const Result<std::vector<MapScene>> ran = map_scenes(o, console);
  if (!ran) return console.fail(ran.error());
  const std::vector<MapScene>& scenes = *ran;
  const MapReport report{o.map, scenes};
  if (!console.json) std::printf("%s", report.text(false).c_str());
  if (!o.csv.empty())
    if (Outcome written = io::write_text_aside(o.csv, report.csv()); !written)
      return console.fail(written.error());
  if (!o.report.empty())
    if (Outcome written = io::write_text_aside(
            o.report, o.report.ends_with(".html") ? map_page(report) : report.text(true));
        !written)
      return console.fail(written.error());
  console.result(report.json());
  const std::string error = report.first_error();
  if (error.empty()) return kOk;
  console.log("hapsix: " + error);
  return kFailed;
}

}  // namespace

void add_map(CLI::App& app, Program& program) {
  CLI::App* map = app.add_subcommand(
      "map",
      "How robust the weight methods are: many variations of every scene, compared in pairs");
  auto o = std::make_shared<Options>();
  map->add_option("--variations", o->map.variations, "Variations of each scene; default 36")
      ->check(whole_within(1, 100000))
      ->option_text("N");
  map->add_option("--seed", o->map.seed, "Another seed draws other variations; default 1")
      ->check(whole_within(0, 1LL << 53))
      ->option_text("SEED");
  std::string methods;
  for (const MethodColumn& m : map_methods()) methods += (methods.empty() ? "" : ",") + m.name;
  map->add_option("--methods", o->methods,
                  "Weight methods, such as robust,gauss6+facing; default: " + methods)
      ->option_text("NAMES");
  map->add_option("--scenes", o->scenes,
                  "Scenes, such as cone-in-gap,peg-in-hole; default: all that are made quickly")
      ->option_text("NAMES");
  map->add_option("--only", o->only, "One variation alone, with every run")
      ->option_text("SCENE:INDEX");
  map->add_option("--jobs", o->map.jobs, "Threads, default 2; the figures do not depend on it")
      ->check(whole_within(1, 256))
      ->option_text("N");
  map->add_option("--scheduler", o->scheduler,
                  "Do the runs on the workers of this scheduler of Dask's distributed; the same "
                  "figures, as far as they have this machine's SIMD target")
      ->option_text("ADDRESS")
      ->excludes("--jobs");
  map->add_option(
         "--keep", o->keep,
         "Keep each variation here as it ends: a map that was killed goes on where it was, "
         "and ends with the same figures")
      ->option_text("FOLDER");
  map->add_flag("--worker", o->worker)->group("");
  map->add_option("--csv", o->csv, "A row for each run")
      ->check(ends_with(".csv"))
      ->option_text("FILE.csv");
  map->add_option("-o,--output", o->report,
                  "The tables as Markdown, or a page that also draws every run")
      ->check([](const std::string& name) {
        const bool good = name.ends_with(".md") || name.ends_with(".html");
        return good ? std::string{} : must_be("a file name that ends in .md or .html", name);
      })
      ->option_text("FILE.md|FILE.html");
  map->callback(
      [&program, o] { program.work = [&program, o] { return map_command(program.console, *o); }; });
}

}  // namespace h6::cli
