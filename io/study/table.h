// SPDX-License-Identifier: Apache-2.0
// table.h - the rows of a study or a map: appended to runs.csv.part as runs end, in order in
// runs.csv at the end. A kill at any time costs the runs that were under way, and nothing else.
// times.csv has how long each run took, so runs.csv has the same bytes after any kills.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hapsix/result.h"

namespace h6::study {

class Table {
 public:
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  Table(Table&& other) noexcept;
  ~Table();
  // Opens the table of a folder, or begins it. Fails when the folder holds other work (another
  // `identity`), or when another process writes to it.
  static Result<Table> open(const std::filesystem::path& folder, const std::string& identity,
                            const std::string& header, std::size_t runs);
  bool has(std::size_t run) const { return !rows_[run].empty(); }
  std::size_t done() const { return done_; }
  const std::vector<std::string>& rows() const { return rows_; }  // "" where a run has none yet
  // `row` begins with the run's number. A second row of a run is refused. `seconds` of wall time;
  // NaN: not known.
  Outcome add(const std::string& row, double seconds);
  // Writes runs.csv, and times.csv in the same order, when every run has its row.
  Outcome finish();
  std::filesystem::path file() const { return folder_ / "runs.csv"; }

 private:
  Table() = default;
  Outcome read_part();
  Outcome read_times();
  bool take(const std::string& row);  // false: it is no whole row
  std::filesystem::path folder_;
  std::string header_;
  std::vector<std::string> rows_;
  std::vector<std::string> seconds_;  // of each run, as text
  std::size_t done_ = 0, columns_ = 0;
  int part_ = -1, times_ = -1;
};

// A field of a row: quoted where it must be; line ends become spaces.
std::string csv_field(std::string text);

}  // namespace h6::study
