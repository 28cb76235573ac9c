// SPDX-License-Identifier: Apache-2.0
// compare.cpp - the first difference of two rows of a recording.
#include <algorithm>
#include <cstring>
#include <sstream>

#include "io/record/layout.h"

namespace h6::io {
namespace {

using namespace recording;

// These bits of the status follow from times and from devices.
constexpr h6Status kGiven = H6_LATE | H6_DEVICE_LOST;

bool among(const std::vector<std::string>& names, const char* name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// What a replay computes, in the order of a frame.
const std::vector<const Column*>& computed() {
  static const std::vector<const Column*> all = [] {
    std::vector<const Column*> found;
    for (const char* name :
         {"t", "frame", "contacts", "max_depth", "max_depth_voxels", "missed_depth_voxels",
          "net_stiffness", "coarse_pairs", "coarse_points", "substeps", "body_pose",
          "body_velocity", "wrench", "command_pose", "cause", "causes", "state", "status", "hash"})
      for (const Column& column : columns())
        if (std::strcmp(column.name, name) == 0) found.push_back(&column);
    return found;
  }();
  return all;
}

// Whether a column follows from the inputs of the safety chain.
bool by_safety(const Column& column) {
  return column.offset >= offsetof(h6FrameRecord, command) &&
         column.offset < offsetof(h6FrameRecord, safety_input) && column.per_hand() &&
         std::strncmp(column.name, "body", 4) != 0;
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

const std::byte* cells(const h6FrameRecord& row, const Column& column, std::size_t hand) {
  return reinterpret_cast<const std::byte*>(&row) + column.offset + hand * column.stride;
}

}  // namespace

std::optional<RowDifference> first_difference(const h6FrameRecord& recorded,
                                              const h6FrameRecord& replayed, std::size_t hands,
                                              const std::vector<std::string>& present) {
  const bool safety = among(present, "safety_asked") && among(present, "overdue");
  h6FrameRecord now = replayed;
  now.report.status =
      static_cast<h6Status>((now.report.status & ~kGiven) | (recorded.report.status & kGiven));
  for (const Column* column : computed()) {
    if ((by_safety(*column) || std::strcmp(column->name, "status") == 0) && !safety) continue;
    const std::size_t bytes = cell_bytes(column->cell);
    for (std::size_t h = 0; h < (column->per_hand() ? hands : 1); ++h) {
      const std::byte *a = cells(recorded, *column, h), *b = cells(now, *column, h);
      if (std::memcmp(a, b, column->width * bytes) == 0 || !among(present, column->name)) continue;
      std::size_t i = 0;
      while (std::memcmp(a + i * bytes, b + i * bytes, bytes) == 0) ++i;
      return RowDifference{column->name, label(*column, i), h,
                           number_at(column->cell, a + i * bytes),
                           number_at(column->cell, b + i * bytes)};
    }
  }
  return std::nullopt;
}

}  // namespace h6::io
