// SPDX-License-Identifier: Apache-2.0
// path_file.cpp - reads, writes and samples hand paths (CSV).
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string_view>

#include "hapsix/vector.h"
#include "io/file/write_aside.h"
#include "io/scene/scene_file.h"

namespace h6::io {
namespace {

constexpr std::uintmax_t kMostPathBytes = std::uintmax_t{512} << 20;
constexpr std::size_t kMostRows = 4'000'000;  // over an hour at 1 kHz
constexpr double kLongest = 1e6;              // [s]
constexpr double kFarthestMetres = 1e6;

std::string_view trimmed(std::string_view text) {
  const char* blank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(blank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blank) - first + 1);
}

bool parse_number(std::string_view text, double& out) {
  text = trimmed(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc{} && end == text.data() + text.size() && std::isfinite(out);
}

// Reads eight numbers. Returns an error message, or an empty text.
std::string parse_row(std::string_view line, double (&row)[8]) {
  std::size_t column = 0;
  for (bool more = true; more; ++column) {
    const std::size_t comma = line.find(',');
    more = comma != std::string_view::npos;
    if (column < 8 && !parse_number(line.substr(0, comma), row[column]))
      return "column " + std::to_string(column + 1) + " is not a number";
    if (more) line.remove_prefix(comma + 1);
  }
  if (column == 8) return {};
  return std::to_string(column) + " columns where t,x,y,z,qw,qx,qy,qz are expected";
}

std::string checked_row(const double (&row)[8], double scale, const Path& before, PathRow& out) {
  out.t = row[0];
  out.pose.p = {row[1] * scale, row[2] * scale, row[3] * scale};
  if (out.t < 0 || out.t > kLongest) return "the time must be 0 to 1000000 s";
  if (!before.empty() && out.t <= before.back().t)
    return "the time does not increase: every row must be later than the one before";
  for (const double x : {out.pose.p.x, out.pose.p.y, out.pose.p.z})
    if (std::abs(x) > kFarthestMetres) return "a position beyond 1000000 m";
  const double norm = std::hypot(std::hypot(row[4], row[5]), std::hypot(row[6], row[7]));
  if (!(std::abs(norm - 1) <= 1e-3)) return "qw,qx,qy,qz is not a unit quaternion";
  out.pose.q = {row[4] / norm, row[5] / norm, row[6] / norm, row[7] / norm};
  return {};
}

// Writes the shortest text that reads back to the same bits, with a decimal point in every locale.
void put_number(std::ostream& out, double value, char after) {
  char text[40];
  char* end = std::to_chars(text, text + sizeof text - 1, value).ptr;
  *end++ = after;
  out.write(text, end - text);
}

// ---- interpolation -----------------------------------------------------------------------------

h6Vec3 mix(const h6Vec3& a, const h6Vec3& b, double s) { return a + s * (b - a); }

// b * conjugate(a), with the sign that makes the turn at most half a turn.
h6Quat shorter_turn(const h6Quat& a, const h6Quat& b) {
  const h6Quat d = product(b, conjugate(a));
  return d.w < 0 ? -d : d;
}

// The rotation vector of a turn of at most half a turn.
h6Vec3 rotation_vector(const h6Quat& d) {
  const double sine = std::hypot(d.x, d.y, d.z);
  // 2 atan2(s, w) / s, whose limit at s = 0 is 2 (w = 1 there).
  const double factor = sine > 1e-12 ? 2 * std::atan2(sine, d.w) / sine : 2;
  return {factor * d.x, factor * d.y, factor * d.z};
}

h6Quat slerp(const h6Quat& a, const h6Quat& b, double s) {
  const h6Vec3 turn = rotation_vector(shorter_turn(a, b));
  const double half = 0.5 * s * std::hypot(turn.x, turn.y, turn.z);
  const double factor = half > 1e-12 ? 0.5 * s * std::sin(half) / half : 0.5 * s;
  const h6Quat d = {std::cos(half), factor * turn.x, factor * turn.y, factor * turn.z};
  const h6Quat q = product(d, a);
  const double norm = std::hypot(std::hypot(q.w, q.x), std::hypot(q.y, q.z));
  return {q.w / norm, q.x / norm, q.y / norm, q.z / norm};
}

// The first row later than t: at t the path is between the row before it and this one.
Path::const_iterator row_after(const Path& path, double t) {
  return std::upper_bound(path.begin(), path.end(), t,
                          [](double time, const PathRow& row) { return time < row.t; });
}

}  // namespace

Result<Path> read_path(const std::filesystem::path& file, Unit unit) {
  const std::string name = file.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    return Failure{name + ": no such file; a hand path is a CSV file t,x,y,z,qw,qx,qy,qz"};
  if (std::filesystem::file_size(file, error) > kMostPathBytes || error)
    return Failure{name + ": larger than 512 MiB; thin the path out"};
  std::ifstream in(file);
  if (!in) return Failure{name + ": cannot be opened; check its permissions"};

  Path path;
  const double scale = metres(unit);
  std::string text;
  bool header_possible = true;
  for (std::size_t line = 1; std::getline(in, text); ++line) {
    const auto failed = [&](const std::string& what) {
      return Failure{name + ":" + std::to_string(line) + ": " + what};
    };
    const std::string_view row_text = trimmed(text);
    if (row_text.empty() || row_text.front() == '#') continue;
    // Only a row whose first column is "t" counts as a header.
    const bool header = header_possible && trimmed(row_text.substr(0, row_text.find(','))) == "t";
    header_possible = false;
    if (header) continue;
    double row[8];
    PathRow checked;
    std::string complaint = parse_row(row_text, row);
    if (complaint.empty()) complaint = checked_row(row, scale, path, checked);
    if (!complaint.empty()) return failed(complaint);
    if (path.size() == kMostRows) return failed("more than 4000000 rows; thin the path out");
    path.push_back(checked);
  }
  if (in.bad()) return Failure{name + ": reading failed before its end"};
  if (path.empty()) return Failure{name + ": no row; a hand path needs at least one"};
  return path;
}

Outcome write_path(const std::filesystem::path& file, const Path& path, Unit unit) {
  return write_aside(file, [&](const std::filesystem::path& aside) -> Outcome {
    const double scale = metres(unit);
    std::ofstream out(aside);
    out << "t,x,y,z,qw,qx,qy,qz\n";
    for (const PathRow& r : path) {
      const h6Vec3& p = r.pose.p;
      const h6Quat& q = r.pose.q;
      const double row[] = {r.t, p.x / scale, p.y / scale, p.z / scale, q.w, q.x, q.y, q.z};
      for (std::size_t column = 0; column < 8; ++column)
        put_number(out, row[column], column == 7 ? '\n' : ',');
    }
    out.close();
    if (!out) return Failure{file.string() + ": writing failed; is the disk full?"};
    return Done{};
  });
}

h6Pose sample_path(const Path& path, double t) {
  const auto next = row_after(path, t);
  if (next == path.begin()) return path.front().pose;
  if (next == path.end()) return path.back().pose;
  const PathRow &a = *(next - 1), &b = *next;
  const double s = (t - a.t) / (b.t - a.t);
  return {mix(a.pose.p, b.pose.p, s), slerp(a.pose.q, b.pose.q, s)};
}

h6Velocity sample_path_velocity(const Path& path, double t) {
  const auto next = row_after(path, t);
  if (next == path.begin() || next == path.end()) return {};
  const PathRow &a = *(next - 1), &b = *next;
  const double dt = b.t - a.t;
  const h6Vec3 turn = rotation_vector(shorter_turn(a.pose.q, b.pose.q));
  return {{(b.pose.p.x - a.pose.p.x) / dt, (b.pose.p.y - a.pose.p.y) / dt,
           (b.pose.p.z - a.pose.p.z) / dt},
          {turn.x / dt, turn.y / dt, turn.z / dt}};
}

}  // namespace h6::io
