// SPDX-License-Identifier: Apache-2.0
#include "io/record/seal.h"

#include <algorithm>
#include <cstring>

#include "io/file/content_hash.h"
#include "io/record/layout.h"

namespace h6::io {

using recording::columns;

RowSeal::RowSeal(std::size_t hands) : hands_(hands) {
  for (std::size_t i = 0; i < columns().size(); ++i)
    if (!columns()[i].apart) columns_.push_back(i);
}

RowSeal::RowSeal(std::size_t hands, const std::vector<std::string>& present) : RowSeal(hands) {
  std::erase_if(columns_, [&](std::size_t i) {
    return std::find(present.begin(), present.end(), columns()[i].name) == present.end();
  });
}

std::uint64_t RowSeal::next(const h6FrameRecord& row) {
  row_.clear();
  for (const std::size_t i : columns_) {
    recording::pack(columns()[i], hands_, &row, 1, cells_);
    row_.insert(row_.end(), cells_.begin(), cells_.end());
  }
  return last_ = hash_on(last_, row_.data(), row_.size());
}

std::uint64_t seal_of_text(std::uint64_t before, const std::string& text) {
  return hash_on(before, text.data(), text.size());
}

std::uint64_t seal_of_event(std::uint64_t before, const RecordingEvent& event) {
  std::string bytes(sizeof event.time, '\0');
  std::memcpy(bytes.data(), &event.time, sizeof event.time);
  return seal_of_text(before, bytes + event.what + '\0' + event.detail);
}

std::uint64_t seal_of_summary(std::uint64_t before, std::uint64_t rows, const std::string& text) {
  return seal_of_text(before, std::to_string(rows) + text);
}

}  // namespace h6::io
