// SPDX-License-Identifier: Apache-2.0
// pick_request.h - which vertices the page chose, parsed from a text that is not trusted.
#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

#include "hapsix/result.h"

namespace h6::io::view {

// The page's last message: {"do": "use", "vertices": [4, 17, ...]} or {"do": "cancel"}.
struct Picked {
  bool use = false;
  std::vector<std::uint32_t> vertices;  // rising, each once, below `count`
};
Result<Picked> parse_picked(std::string_view text, std::size_t count);

}  // namespace h6::io::view
