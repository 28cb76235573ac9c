// field_grids.h - the parts of reading .vdb files that stand apart. Private to field_*.cpp.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <openvdb/Grid.h>

#include "hapsix/result.h"
#include "io/field_data.h"

namespace h6::io {

inline constexpr int kMaxBricksOnSide = 256;

// field_foreign.cpp: a level set somebody else made; `name` stands in the sentence.
Result<FieldData> foreign_field(const openvdb::GridPtrVec& grids, const std::string& name);

// field_scan.cpp: that every length in the head of the file and of its grids fits into the file.
Outcome check_vdb_lengths(const std::filesystem::path& file);

}  // namespace h6::io
