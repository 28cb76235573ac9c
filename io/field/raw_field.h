// SPDX-License-Identifier: Apache-2.0
// raw_field.h - a field as the cache keeps it: its arrays as they lie in memory.
//
// The format is private to one machine and one version of hapsix. It exists for speed: OpenVDB
// takes three times as long to write an uncompressed field of 1024^3 voxels.
#pragma once
#include <filesystem>

#include "hapsix/result.h"
#include "io/field/field_data.h"

namespace h6::io {

// Written aside, then renamed.
Outcome write_raw_field(const std::filesystem::path& file, const FieldData& field);
// Reads a field back bit for bit. Fails, with a sentence, when the file is of another kind or
// version, truncated or damaged. Never allocates more memory than the file's size. The floats of
// the field stay in the file: while it lives, the file may be renamed, replaced or removed, but
// not cut (mapped_file.h).
Result<FieldData> read_raw_field(const std::filesystem::path& file);

}  // namespace h6::io
