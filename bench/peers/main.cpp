// SPDX-License-Identifier: Apache-2.0
// main.cpp - hapsix_peers [--json FILE] [--svg FILE] [NAME...]: hapsix and other libraries on the
// same tasks. Names are those of tasks, `bakes` and `batch`; default all.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/peers/bakes.h"
#include "bench/peers/batch.h"
#include "bench/peers/measure.h"
#include "bench/peers/picture.h"
#include "io/console/console.h"
#include "io/experiments/report.h"
#include "io/file/write_aside.h"

namespace h6::peers {
namespace {

using cli::number, cli::TextTable;
using Json = nlohmann::ordered_json;

constexpr const char* kBakes[] = {"alpha-shortcut", "spline-hub-10k", "engine-bay"};

std::string pair(const Quantiles& q, int digits) {
  return number(q.p50, digits) + ", " + number(q.p99, digits);
}
int digits_of(double us) { return us < 100 ? 1 : 0; }

TextTable table_of(const TaskReport& task) {
  TextTable table{{"peer", "poses", "path p50, p99 [µs]", "random p50, p99 [µs]", "over ours",
                   "random", "contacts", "depth off [voxel]", "direction off [°]", "missed",
                   "depth change [voxel]", "direction change [°]"}};
  const Row& ours = task.rows.front();
  for (const std::vector<Row>* rows : {&task.rows, &task.truth})
    for (const Row& r : *rows) {
      const bool timed = r.path.p50 > 0;
      table.push_back(
          {r.peer, std::to_string(r.poses), timed ? pair(r.path, digits_of(r.path.p50)) : "–",
           timed ? pair(r.shuffled, digits_of(r.shuffled.p50)) : "–",
           timed ? number(r.path.p50 / ours.path.p50, 1) : "–",
           timed ? number(r.shuffled.p50 / ours.shuffled.p50, 1) : "–", number(r.contacts, 0),
           pair(r.depth, 3), pair(r.direction, 1), number(100 * r.missed, 0) + " %",
           pair(r.depth_change, 3), pair(r.direction_change, 1)});
    }
  return table;
}

Json json_of(const Quantiles& q) { return {{"p50", q.p50}, {"p99", q.p99}}; }
Json json_of(const TaskReport& task) {
  Json out{{"about", task.about},
           {"part_triangles", task.part_triangles},
           {"obstacle_triangles", task.obstacle_triangles},
           {"points", task.points},
           {"voxel", task.voxel},
           {"offset", task.offset},
           {"poses_compared_with_brute_force", task.compared},
           {"peers", Json::object()}};
  for (const std::vector<Row>* rows : {&task.rows, &task.truth})
    for (const Row& r : *rows) {
      Json& row = out["peers"][r.peer];
      row = {{"poses", r.poses},
             {"contacts", r.contacts},
             {"depth_error_voxels", json_of(r.depth)},
             {"direction_error_degrees", json_of(r.direction)},
             {"missed", r.missed},
             {"depth_change_voxels", json_of(r.depth_change)},
             {"direction_change_degrees", json_of(r.direction_change)}};
      if (r.path.p50 > 0) row["path_us"] = json_of(r.path), row["random_us"] = json_of(r.shuffled);
    }
  return out;
}

TextTable table_of(const std::vector<BakeRow>& rows) {
  TextTable table{{"mesh", "triangles", "voxel [mm]", "ours 1, 2 threads [ms]",
                   "OpenVDB 1, 2 threads [ms]", "times", "bricks, theirs",
                   "distance off, theirs [voxel]"}};
  for (const BakeRow& r : rows)
    table.push_back({r.mesh, std::to_string(r.triangles), number(1e3 * r.voxel, 3),
                     number(r.ours_ms[0], 0) + ", " + number(r.ours_ms[1], 0),
                     number(r.openvdb_ms[0], 0) + ", " + number(r.openvdb_ms[1], 0),
                     number(r.openvdb_ms[0] / r.ours_ms[0], 1) + ", " +
                         number(r.openvdb_ms[1] / r.ours_ms[1], 1),
                     std::to_string(r.ours_bricks) + ", " + std::to_string(r.openvdb_bricks),
                     number(r.ours_error, 6) + ", " + number(r.openvdb_error, 6)});
  return table;
}

TextTable table_of(const std::vector<BatchRow>& rows) {
  TextTable table{{"peer", "sessions", "1 thread [1/s]", "2 threads [1/s]", "times", "contacts",
                   "ours over it, 2 threads"}};
  for (const BatchRow& r : rows) {
    const auto ours = std::find_if(rows.begin(), rows.end(),
                                   [&](const BatchRow& o) { return o.sessions == r.sessions; });
    table.push_back({r.peer, std::to_string(r.sessions), number(r.per_second[0], 0),
                     number(r.per_second[1], 0), number(r.per_second[1] / r.per_second[0], 2),
                     number(r.contacts, 0), number(ours->per_second[1] / r.per_second[1], 1)});
  }
  return table;
}

Json json_of(const BatchRow& r) {
  return {{"peer", r.peer},
          {"sessions", r.sessions},
          {"steps_per_second", r.per_second},
          {"contacts", r.contacts}};
}

Json json_of(const BakeRow& r) {
  return {{"triangles", r.triangles},
          {"voxel", r.voxel},
          {"ours_ms", r.ours_ms},
          {"openvdb_ms", r.openvdb_ms},
          {"ours_bricks", r.ours_bricks},
          {"openvdb_bricks", r.openvdb_bricks},
          {"ours_error_voxels", r.ours_error},
          {"openvdb_error_voxels", r.openvdb_error},
          {"nodes", r.nodes}};
}

struct Arguments {
  std::string json, svg;
  std::vector<std::string> names;
};

Result<Arguments> parse(int count, char** values) {
  Arguments out;
  std::vector<std::string> known = task_names();
  known.insert(known.end(), {"bakes", "batch"});
  for (int i = 1; i < count; ++i) {
    const std::string word = values[i];
    if (word == "--json" || word == "--svg") {
      if (++i == count) return Failure{word + " needs a file"};
      (word == "--json" ? out.json : out.svg) = values[i];
    } else if (std::find(known.begin(), known.end(), word) != known.end()) {
      out.names.push_back(word);
    } else {
      std::string list;
      for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
      return Failure{"no task named '" + word + "': " + list};
    }
  }
  if (out.names.empty()) out.names = known;
  return out;
}

int run(int count, char** values) {
  const cli::Console console;
  const Result<Arguments> arguments = parse(count, values);
  if (!arguments) return console.fail(arguments.error(), cli::kUsage);
  Json json{{"tasks", Json::object()}, {"bakes", Json::object()}};
  std::vector<TaskReport> tasks;
  std::vector<BakeRow> bakes;
  for (const std::string& name : arguments->names) {
    if (name == "bakes") {
      for (const char* mesh : kBakes) {
        Result<BakeRow> row = compare_bakes(mesh);
        if (!row) return console.fail(row.error());
        json["bakes"][mesh] = json_of(*row);
        bakes.push_back(*row);
      }
      std::printf("bakes\n%s\n", cli::markdown(table_of(bakes)).c_str());
      continue;
    }
    if (name == "batch") {
      const Result<std::vector<BatchRow>> rows = compare_batches(console.progress());
      if (!rows) return console.fail(rows.error());
      for (const BatchRow& row : *rows) json["batch"].push_back(json_of(row));
      std::printf("batch\n%s\n", cli::markdown(table_of(*rows)).c_str());
      continue;
    }
    Result<std::unique_ptr<Task>> task = make_task(name);
    if (!task) return console.fail(task.error());
    Result<TaskReport> report = measure(**task, console.progress());
    if (!report) return console.fail(report.error());
    std::printf("%s: %s; %zu and %zu triangles, %zu points, voxel %.3f mm\n%s\n", name.c_str(),
                report->about.c_str(), report->part_triangles, report->obstacle_triangles,
                report->points, 1e3 * report->voxel, cli::markdown(table_of(*report)).c_str());
    std::fflush(stdout);
    json["tasks"][name] = json_of(*report);
    tasks.push_back(std::move(*report));
  }
  if (!arguments->json.empty())
    if (Outcome done = io::write_text_aside(arguments->json, json.dump(2) + "\n"); !done)
      return console.fail(done.error());
  if (!arguments->svg.empty())
    if (Outcome done = io::write_text_aside(arguments->svg, svg_of(tasks)); !done)
      return console.fail(done.error());
  return cli::kOk;
}

}  // namespace
}  // namespace h6::peers

int main(int count, char** values) { return h6::peers::run(count, values); }
