// SPDX-License-Identifier: Apache-2.0
#include "io/cli/mesh_unit.h"

#include <unistd.h>

#include <iostream>

namespace h6::cli {
namespace {

// The answer, or an empty text where there is no terminal, or no unit is named.
std::string ask(const Console& console, const std::string& file, double across) {
  if (console.json || isatty(STDIN_FILENO) == 0 || isatty(STDERR_FILENO) == 0) return "";
  char text[120];
  std::snprintf(text, sizeof text,
                ": it is %.4g units across. In which unit is it (m, mm, cm, in)?", across);
  console.log(file + text);
  std::string answer;
  std::getline(std::cin, answer);
  return io::unit_from_name(answer) ? answer : "";
}

}  // namespace

Result<io::Mesh> read_in_unit(const Console& console, const std::string& file, bool stated,
                              std::string& units) {
  const Result<io::Unit> unit = io::unit_from_name(units);
  if (!unit) return unit.failure();
  Result<io::Mesh> mesh = io::read_mesh(file, *unit);
  if (!mesh || stated || !mesh->unit_is_doubtful) return mesh;
  const std::string answer = ask(console, file, io::bounds_of(*mesh).longest());
  if (answer.empty()) return Failure{mesh->remarks.back() + " If they are metres: --units m."};
  units = answer;
  mesh = io::read_mesh(file, *io::unit_from_name(units));
  if (mesh && mesh->unit_is_doubtful) mesh->remarks.pop_back();  // it is answered
  return mesh;
}

io::FieldBake in_metres(io::FieldBake options, const std::string& units) {
  const double unit = io::metres(*io::unit_from_name(units));
  options.voxel_size *= unit;
  options.tolerance *= unit;
  options.seal *= unit;
  options.weld_length *= unit;
  if (options.offset > 0) options.offset *= unit;
  return options;
}

}  // namespace h6::cli
