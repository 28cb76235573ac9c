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
using recording::Part;

template <class T>
void append_number(const std::byte*& from, std::string& out) {
  T value;
  std::memcpy(&value, from, sizeof value);
  from += sizeof value;
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

void append_cell(Cell cell, const std::byte*& from, std::string& out) {
  if (cell == Cell::real)
    append_number<double>(from, out);
  else if (cell == Cell::natural32)
    append_number<std::uint32_t>(from, out);
  else
    append_number<std::uint64_t>(from, out);
}

}  // namespace

std::string csv_head(const RecordingHead& head) {
  const std::size_t hands = head.hands;
  std::string out;
  for (const Column& column : recording::columns(head.bends)) {
    if (column.part == Part::seal) continue;
    std::istringstream labels(column.labels);
    std::vector<std::string> cells;
    for (std::string label; labels >> label;) cells.push_back(label);
    for (std::size_t hand = 0; hand < (column.per_hand() ? hands : 1); ++hand)
      for (std::size_t i = 0; i < column.width; ++i) {
        if (!out.empty()) out += ',';
        out += column.name;
        if (column.width > 1 || column.part == Part::bends)
          out += "_" + (i < cells.size() ? cells[i] : std::to_string(i));
        if (column.per_hand() && hands > 1) out += "_" + std::to_string(hand);
      }
  }
  return out + '\n';
}

void append_csv(const Recording& piece, std::string& out) {
  const std::vector<Column> columns = recording::columns(piece.head.bends);
  const std::size_t hands = piece.head.hands, modes = modes_of(piece.head.bends);
  std::vector<std::byte> row;
  for (std::size_t i = 0; i < piece.frames.size(); ++i) {
    bool first = true;
    for (const Column& column : columns) {
      if (column.part == Part::seal) continue;
      recording::pack(column, hands,
                      {&piece.frames[i], piece.bends.data() + i * modes, nullptr, 1, modes}, row);
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
