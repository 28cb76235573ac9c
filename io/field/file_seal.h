// SPDX-License-Identifier: Apache-2.0
// file_seal.h - a checksum of a whole file inside that file.
//
// The file holds seal_text() once, within its first 64 KiB, where its format keeps text. Its digits
// are a hash of all bytes, computed with these digits left out. Readers of formats that trust their
// input check the seal before they parse.
#pragma once
#include <filesystem>
#include <string>

#include "hapsix/result.h"

namespace h6::io {

std::string seal_text();  // a mark and 32 zeros
Outcome seal_file(const std::filesystem::path& file);

enum class Seal { whole, broken, none };  // none: a file of another program
Result<Seal> check_seal(const std::filesystem::path& file);

}  // namespace h6::io
