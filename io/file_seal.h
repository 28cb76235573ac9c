// file_seal.h - a checksum of a whole file inside that file.
//
// The file holds seal_text() once, near its start, where its format keeps text. seal_file then
// replaces the digits by a hash of all bytes, taken with the digits as zeros. Readers of formats
// that trust their input look at the seal before they parse.
#pragma once
#include <filesystem>
#include <string>

#include "hapsix/result.h"

namespace h6::io {

std::string seal_text();  // a mark and 32 zeros
Outcome seal_file(const std::filesystem::path& file);

enum class Seal { whole, broken, none };  // none: somebody else's file
Result<Seal> check_seal(const std::filesystem::path& file);

}  // namespace h6::io
