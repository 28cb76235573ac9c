// SPDX-License-Identifier: Apache-2.0
#include "io/record/seal.h"

#include <algorithm>
#include <cstring>

#include "io/file/content_hash.h"
#include "io/record/layout.h"

namespace h6::io {

using recording::Column;

RowSeal::RowSeal(const RecordingHead& head) : RowSeal(head, {}) {}

RowSeal::RowSeal(const RecordingHead& head, const std::vector<std::string>& present)
    : hands_(head.hands), modes_(modes_of(head.bends)) {
  std::vector<Column> sealed = recording::columns(head.bends);
  std::erase_if(sealed, [&](const Column& column) {
    return column.part == recording::Part::seal ||
           (!present.empty() &&
            std::find(present.begin(), present.end(), column.name) == present.end());
  });
  columns_ = std::make_shared<const std::vector<Column>>(std::move(sealed));
}

std::uint64_t RowSeal::next(const h6FrameRecord& row, const double* bends) {
  row_.clear();
  for (const Column& column : *columns_) {
    recording::pack(column, hands_, {&row, bends, nullptr, 1, modes_}, cells_);
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
