// SPDX-License-Identifier: Apache-2.0
// compare.cpp - the first difference of two rows of a recording.
#include <cstring>
#include <sstream>

#include "io/record/layout.h"

namespace h6::io {
namespace {

using namespace recording;

const Column* column_named(const char* name) {
  for (const Column& column : columns())
    if (std::strcmp(column.name, name) == 0) return &column;
  return nullptr;
}

std::string label(const Column& column, std::size_t cell) {
  std::istringstream labels(column.labels);
  std::string text;
  for (std::size_t i = 0; i <= cell && labels >> text; ++i) {
  }
  return text;
}

double number_at(Cell cell, const std::byte* at) {
  if (cell == Cell::natural32) {
    std::uint32_t value;
    std::memcpy(&value, at, sizeof value);
    return value;
  }
  if (cell == Cell::natural64) {
    std::uint64_t value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  }
  double value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

}  // namespace

std::optional<RowDifference> first_difference(const h6FrameRecord& a, const h6FrameRecord& b,
                                              std::size_t hands, bool commands) {
  static const Column* const order[] = {
      column_named("contacts"),      column_named("max_depth"),    column_named("max_depth_voxels"),
      column_named("net_stiffness"), column_named("body_pose"),    column_named("body_velocity"),
      column_named("wrench"),        column_named("command_pose"), column_named("hash")};
  std::vector<std::byte> one, two;
  for (const Column* column : order) {
    const bool told = column->offset >= offsetof(h6FrameRecord, command) &&
                      column->offset < offsetof(h6FrameRecord, command) + sizeof a.command;
    if (told && !commands) continue;
    pack(*column, hands, &a, 1, one);
    pack(*column, hands, &b, 1, two);
    const std::size_t bytes = cell_bytes(column->cell);
    for (std::size_t i = 0; i * bytes < one.size(); ++i) {
      if (std::memcmp(&one[i * bytes], &two[i * bytes], bytes) == 0) continue;
      return RowDifference{column->name, label(*column, i % column->width), i / column->width,
                           number_at(column->cell, &one[i * bytes]),
                           number_at(column->cell, &two[i * bytes])};
    }
  }
  return std::nullopt;
}

}  // namespace h6::io
