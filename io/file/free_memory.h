// SPDX-License-Identifier: Apache-2.0
// free_memory.h - how much memory this process can still take.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>

namespace h6::io {

// Bytes: the least of what the machine has available and of what the control groups of this process
// leave (both versions; pages of files that they can drop count as free). Without swap. No value
// where the system does not tell. `root` is the root of the file system, or of a copy for tests.
std::optional<std::uint64_t> free_memory(const std::filesystem::path& root = "/");

}  // namespace h6::io
