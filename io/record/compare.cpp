// SPDX-License-Identifier: Apache-2.0
// compare.cpp - the first difference of two rows of a recording.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "io/record/layout.h"

namespace h6::io {
namespace {

using namespace recording;

// These bits of the status follow from times and from devices.
constexpr h6Status kGiven = H6_LATE | H6_DEVICE_LOST;

bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// The columns that a replay computes, in the order of a frame; bodies that bend come first.
std::vector<Column> computed(const std::vector<RecordedBend>& bends) {
  std::vector<Column> found;
  const std::vector<Column> all = columns(bends);
  for (const char* name : {"t",
                           "frame",
                           "contacts",
                           "max_depth",
                           "max_depth_voxels",
                           "missed_depth_voxels",
                           "net_stiffness",
                           "coarse_pairs",
                           "coarse_points",
                           "substeps",
                           "bends",
                           "body_pose",
                           "body_velocity",
                           "wrench",
                           "command_pose",
                           "cause",
                           "causes",
                           "state",
                           "status",
                           "hash"})
    for (const Column& column : all)
      if (column.name == name || (column.part == Part::bends && std::strcmp(name, "bends") == 0))
        found.push_back(column);
  return found;
}

// Whether a column follows from the inputs of the safety chain.
bool by_safety(const Column& column) {
  return column.part == Part::record && column.offset >= offsetof(h6FrameRecord, command) &&
         column.offset < offsetof(h6FrameRecord, safety_input) && column.per_hand() &&
         !column.name.starts_with("body");
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

const std::byte* cells(const Column& column, const h6FrameRecord& row, const double* bends,
                       std::size_t hand) {
  const void* part = column.part == Part::bends ? static_cast<const void*>(bends) : &row;
  return static_cast<const std::byte*>(part) + column.offset + hand * column.stride;
}

// A program may record rows without the shapes of bodies that bend.
bool known(const Column& column, const std::byte* at) {
  return column.part != Part::bends || !std::isnan(number_at(column.cell, at));
}

}  // namespace

RowComparison::RowComparison(const RecordingHead& head, const std::vector<std::string>& present)
    : hands_(head.hands) {
  const bool safety = among(present, "safety_asked") && among(present, "overdue");
  std::vector<Column> compared = computed(head.bends);
  std::erase_if(compared, [&](const Column& column) {
    return !among(present, column.name) ||
           ((by_safety(column) || column.name == "status") && !safety);
  });
  columns_ = std::make_shared<const std::vector<Column>>(std::move(compared));
}

std::optional<RowDifference> RowComparison::first(const h6FrameRecord& recorded,
                                                  const double* recorded_bends,
                                                  const h6FrameRecord& replayed,
                                                  const double* replayed_bends) const {
  h6FrameRecord now = replayed;
  now.report.status =
      static_cast<h6Status>((now.report.status & ~kGiven) | (recorded.report.status & kGiven));
  for (const Column& column : *columns_) {
    const std::size_t bytes = cell_bytes(column.cell);
    for (std::size_t h = 0; h < (column.per_hand() ? hands_ : 1); ++h) {
      const std::byte *a = cells(column, recorded, recorded_bends, h),
                      *b = cells(column, now, replayed_bends, h);
      if (std::memcmp(a, b, column.width * bytes) == 0 || !known(column, a)) continue;
      std::size_t i = 0;
      while (std::memcmp(a + i * bytes, b + i * bytes, bytes) == 0) ++i;
      return RowDifference{column.name, label(column, i), h, number_at(column.cell, a + i * bytes),
                           number_at(column.cell, b + i * bytes)};
    }
  }
  return std::nullopt;
}

}  // namespace h6::io
