// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/map/kept_map.h"

#include <filesystem>

#include "hapsix/hapsix.h"

namespace h6::cli {
namespace {

namespace fs = std::filesystem;

// A row is the job, which variation it is, and its runs as job_line gives them, to the bit.
std::string row_begin(const MapPlan& plan, std::size_t job) {
  const MapScene& scene = plan.scenes[plan.jobs[job].scene];
  return std::to_string(job) + "," + scene.name + "," +
         std::to_string(scene.variations[plan.jobs[job].variation].index) + ",";
}

// The text that csv_field quoted.
std::string unquoted(const std::string& field) {
  if (field.empty() || field[0] != '"') return field;
  std::string out;
  for (std::size_t i = 1; i + 1 < field.size(); ++i) {
    out += field[i];
    if (field[i] == '"') ++i;
  }
  return out;
}

}  // namespace

Outcome KeptMap::open(const std::string& folder, const std::vector<std::string>& words,
                      MapPlan& plan) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error))
    return Failure{"cannot make the folder " + folder + ": " + error.message()};
  // Other instructions, such as those of another processor, may give other bits.
  std::string identity = h6BuildInfo();
  for (const std::string& word : words) identity += "\n" + word;
  Result<study::Table> table =
      study::Table::open(folder, identity + "\n", "run,scene,index,runs", plan.jobs.size());
  if (!table) return table.failure();
  for (std::size_t job = 0; job < plan.jobs.size(); ++job) {
    if (!table->has(job)) continue;
    const std::string begin = row_begin(plan, job), &row = table->rows()[job];
    if (!row.starts_with(begin) || !take_job_line(plan, job, unquoted(row.substr(begin.size()))))
      return Failure{folder + ": row " + std::to_string(job) +
                     " of its table is damaged: remove the folder"};
  }
  table_.emplace(std::move(*table));
  return Done{};
}

Outcome KeptMap::add(const MapPlan& plan, std::size_t job, double seconds) {
  if (!table_) return Done{};
  return table_->add(row_begin(plan, job) + study::csv_field(job_line(plan, job)), seconds);
}

Outcome KeptMap::finish() { return table_ ? table_->finish() : Outcome(Done{}); }

}  // namespace h6::cli
