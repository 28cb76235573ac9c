// SPDX-License-Identifier: Apache-2.0
// seal.h - shows where a recording was changed.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "io/record/recording.h"

namespace h6::io {

// The seal of a row: a hash of all its numbers and of the seal of the row before. It shows where a
// file was changed, by accident or by hand. It does not stop a forger, who can compute it too.
class RowSeal {
 public:
  explicit RowSeal(const RecordingHead& head);  // of a new recording
  // `columns`: those of the recording, which may lack newer ones.
  RowSeal(const RecordingHead& head, const std::vector<std::string>& columns);
  // `bends`: q of all bodies that bend.
  std::uint64_t next(const h6FrameRecord& row, const double* bends);

 private:
  std::size_t hands_, modes_;
  std::shared_ptr<const std::vector<recording::Column>> columns_;
  std::vector<std::byte> cells_, row_;
  std::uint64_t last_ = 0;
};

// Seals of the other parts, each on top of what comes before it: /config's text, then every event,
// then the summary with the number of rows. 0 has been sealed before the first.
std::uint64_t seal_of_text(std::uint64_t before, const std::string& text);
std::uint64_t seal_of_event(std::uint64_t before, const RecordingEvent& event);
std::uint64_t seal_of_summary(std::uint64_t before, std::uint64_t rows, const std::string& text);

}  // namespace h6::io
