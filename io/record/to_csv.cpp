// SPDX-License-Identifier: Apache-2.0
#include "io/record/to_csv.h"

#include <charconv>
#include <cstring>
#include <sstream>

#include "io/record/layout.h"

namespace h6::io {
namespace {

using recording::Cell;
using recording::Column;

template <class T>
void append_number(const std::byte*& from, std::string& out) {
  T value;
  std::memcpy(&value, from, sizeof value);
  from += sizeof value;
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void append_cell(Cell cell, const std::byte*& from, std::string& out) {
  if (cell == Cell::real) append_number<double>(from, out);
  else if (cell == Cell::natural32) append_number<std::uint32_t>(from, out);
  else append_number<std::uint64_t>(from, out);
}

}  // namespace

std::string csv_head(std::size_t hands) {
  std::string out;
  for (const Column& column : recording::columns()) {
    if (column.apart) continue;
    std::istringstream labels(column.labels);
    std::vector<std::string> cells;
    for (std::string label; labels >> label;) cells.push_back(label);
    for (std::size_t hand = 0; hand < (column.per_hand() ? hands : 1); ++hand)
      for (std::size_t i = 0; i < column.width; ++i) {
        if (!out.empty()) out += ',';
        out += column.name;
        if (column.width > 1) out += "_" + (i < cells.size() ? cells[i] : std::to_string(i));
        if (column.per_hand() && hands > 1) out += "_" + std::to_string(hand);
      }
  }
  return out + '\n';
}

void append_csv(const std::vector<h6FrameRecord>& frames, std::size_t hands, std::string& out) {
  std::vector<std::byte> row;
  for (const h6FrameRecord& frame : frames) {
    bool first = true;
    for (const Column& column : recording::columns()) {
      if (column.apart) continue;
      recording::pack(column, hands, &frame, 1, row);
      const std::byte* from = row.data();
      for (const std::byte* end = from + recording::row_bytes(column, hands); from < end;) {
        if (!first) out += ',';
        first = false;
        append_cell(column.cell, from, out);
      }
    }
    out += '\n';
  }
}

}  // namespace h6::io
