// SPDX-License-Identifier: Apache-2.0
#include "io/study/table.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include "io/file/write_aside.h"

namespace h6::study {
namespace fs = std::filesystem;

namespace {

std::string whole_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

// Fields of a row; a comma inside quotes is none between fields.
std::size_t fields_of(const std::string& row) {
  bool quoted = false;
  std::size_t n = 1;
  for (const char c : row) {
    if (c == '"') quoted = !quoted;
    n += c == ',' && !quoted;
  }
  return quoted ? 0 : n;
}

constexpr const char* kTimesHeader = "run,seconds\n";

Failure cannot(const char* what, const fs::path& file) {
  return Failure{std::string("cannot ") + what + " " + file.string() + ": " + std::strerror(errno)};
}

Outcome append(int to, const std::string& text, const fs::path& file) {
  for (std::size_t at = 0; at < text.size();) {
    const ssize_t n = write(to, text.data() + at, text.size() - at);
    if (n < 0 && errno != EINTR) return cannot("write", file);
    if (n > 0) at += static_cast<std::size_t>(n);
  }
  return Done{};
}

// A torn last line is cut off.
template <class Line>
Outcome each_whole_line(int open, const fs::path& file, const Line& line) {
  const std::string text = whole_file(file);
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1)
    line(text.substr(begin, end - begin));
  if (begin < text.size() && ftruncate(open, static_cast<off_t>(begin)) != 0)
    return cannot("shorten", file);
  return Done{};
}

}  // namespace

std::string csv_field(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  if (text.find_first_of(",\"") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

Table::Table(Table&& other) noexcept
    : folder_(std::move(other.folder_)),
      header_(std::move(other.header_)),
      rows_(std::move(other.rows_)),
      seconds_(std::move(other.seconds_)),
      done_(other.done_),
      columns_(other.columns_),
      part_(std::exchange(other.part_, -1)),
      times_(std::exchange(other.times_, -1)) {}
Table::~Table() {
  for (const int file : {part_, times_})
    if (file >= 0) close(file);
}

Result<Table> Table::open(const fs::path& folder, const std::string& identity,
                          const std::string& header, std::size_t runs) {
  Table table;
  table.folder_ = folder, table.header_ = header;
  table.rows_.resize(runs), table.seconds_.resize(runs), table.columns_ = fields_of(header);
  const fs::path part = folder / "runs.csv.part", known = folder / "study.txt";
  // Not inherited: workers that outlive a killed study must not keep the lock.
  table.part_ = ::open(part.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (table.part_ < 0) return cannot("write", part);
  if (flock(table.part_, LOCK_EX | LOCK_NB) != 0)
    return Failure{folder.string() + ": another hapsix study or map runs here, wait for its end"};
  std::error_code error;
  if (!fs::exists(known, error)) {
    if (const Outcome written = io::write_text_aside(known, identity); !written)
      return written.failure();
  } else if (whole_file(known) != identity) {
    return Failure{
        folder.string() +
        ": this folder has the runs of another study, map, scene, version or processor: choose "
        "another, or remove it"};
  }
  if (const Outcome read = table.read_part(); !read) return read.failure();
  if (const Outcome read = table.read_times(); !read) return read.failure();
  return table;
}

bool Table::take(const std::string& row) {
  const std::size_t comma = row.find(',');
  if (comma == 0 || comma == std::string::npos || comma > 7 ||
      row.find_first_not_of("0123456789") != comma || fields_of(row) != columns_)
    return false;
  const std::size_t run = std::stoul(row);
  if (run >= rows_.size() || has(run)) return false;
  rows_[run] = row;
  ++done_;
  return true;
}

// Rows of runs.csv, where the study is done, and of the part.
Outcome Table::read_part() {
  std::istringstream finished(whole_file(file()));
  std::string row;
  for (std::getline(finished, row); std::getline(finished, row);) take(row);
  const fs::path part = folder_ / "runs.csv.part";
  return each_whole_line(part_, part, [&](const std::string& line) { take(line); });
}

// Of two lines of a run the later one is right: its row came after it.
Outcome Table::read_times() {
  const fs::path file = folder_ / "times.csv";
  times_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (times_ < 0) return cannot("write", file);
  bool begun = false;
  const Outcome read = each_whole_line(times_, file, [&](const std::string& line) {
    begun = true;
    const std::size_t comma = line.find(',');
    if (comma == 0 || comma > 7 || line.find_first_not_of("0123456789") != comma) return;
    const std::size_t run = std::stoul(line);
    if (run < seconds_.size()) seconds_[run] = line.substr(comma + 1);
  });
  return !read || begun ? read : append(times_, kTimesHeader, file);
}

// The time first, so that a kill between the two leaves no row without one.
Outcome Table::add(const std::string& row, double seconds) {
  if (!take(row)) return Failure{"a worker gave no row of this table: " + row.substr(0, 100)};
  const std::size_t run = std::stoul(row);
  seconds_[run] = std::isnan(seconds) ? "" : std::to_string(seconds);
  const std::string time = std::to_string(run) + "," + seconds_[run] + "\n";
  if (const Outcome timed = append(times_, time, folder_ / "times.csv"); !timed) return timed;
  return append(part_, row + "\n", folder_ / "runs.csv.part");
}

Outcome Table::finish() {
  std::string text = header_ + "\n";
  for (const std::string& row : rows_) text += row + "\n";
  std::string times = kTimesHeader;
  for (std::size_t run = 0; run < seconds_.size(); ++run)
    times += std::to_string(run) + "," + seconds_[run] + "\n";
  if (const Outcome written = io::write_text_aside(folder_ / "times.csv", times); !written)
    return written;
  if (const Outcome written = io::write_text_aside(file(), text); !written) return written;
  std::error_code error;
  fs::remove(folder_ / "runs.csv.part", error);
  return Done{};
}

}  // namespace h6::study
