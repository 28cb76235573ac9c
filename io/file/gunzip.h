// SPDX-License-Identifier: Apache-2.0
// gunzip.h - inflates a .gz held in memory.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "hapsix/result.h"

namespace h6::io {

// Fails with a sentence that begins with `name` when the bytes are not gzip, damaged, truncated or
// a bomb: more than `limit` bytes, or over 16 MiB and more than 250 times the compressed size
// (meshes compress 2 to 50 times, zeros 1,030 times). As in gzip, members that follow each other
// are one file.
Result<std::string> gunzip(std::string_view bytes, const std::string& name,
                           std::size_t limit = std::size_t{8} << 30);

}  // namespace h6::io
