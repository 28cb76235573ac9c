// SPDX-License-Identifier: Apache-2.0
// seal.h - shows in which row a recording was changed.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"

namespace h6::io {

// The seal of a row: a hash of all its numbers and of the seal of the row before. It shows where a
// file was changed, by accident or by hand. It does not stop a forger, who can compute it too.
class RowSeal {
 public:
  explicit RowSeal(std::size_t hands);  // of a new recording
  // `columns`: those of the recording, which may lack newer ones.
  RowSeal(std::size_t hands, const std::vector<std::string>& columns);
  std::uint64_t next(const h6FrameRecord& row);

 private:
  std::size_t hands_;
  std::vector<std::size_t> columns_;  // indices into recording::columns()
  std::vector<std::byte> cells_, row_;
  std::uint64_t last_ = 0;
};

}  // namespace h6::io
