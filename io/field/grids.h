// SPDX-License-Identifier: Apache-2.0
// grids.h - what the ways to read and write .vdb files share. Private to field_*.cpp.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include <openvdb/Grid.h>
#include <openvdb/openvdb.h>

#include "hapsix/result.h"
#include "io/field/field_data.h"

namespace h6::io {

inline constexpr int kMaxBricksOnSide = 256;
inline constexpr std::int32_t kFieldFormat = 2;  // hapsix_format; 2 has `triangle`

// Cells of a box of bricks, or nodes of its far grid, x fastest.
struct Place {
  std::array<std::int32_t, 3> size;
  std::array<std::int32_t, 3> at(std::size_t i) const {
    const std::size_t x = std::size_t(size[0]), y = std::size_t(size[1]);
    return {std::int32_t(i % x), std::int32_t(i / x % y), std::int32_t(i / x / y)};
  }
  std::size_t index(std::int32_t a, std::int32_t b, std::int32_t c) const {
    return (std::size_t(c) * std::size_t(size[1]) + std::size_t(b)) * std::size_t(size[0]) +
           std::size_t(a);
  }
  std::size_t count() const {
    return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]);
  }
};

// ---- grids.cpp: all of a field but its samples --------------------------------------------

// `distance` without a leaf: its name, place and metadata.
openvdb::FloatGrid::Ptr bare_distance_grid(const FieldData& field);
// `far`, and where there are such `part` and `triangle`.
openvdb::GridPtrVec small_grids(const FieldData& field);

// Back again; false where it is no whole field of this format. The bricks and samples must be there
// before take_small.
bool take_head(const openvdb::FloatGrid& distance, FieldData& field);
bool take_small(const openvdb::GridPtrVec& grids, FieldData& field);
// The distance grid of a file of ours, whatever its format; else null.
openvdb::FloatGrid::Ptr own_distance(const openvdb::GridPtrVec& grids);

// ---- scan.cpp: a look at a file before OpenVDB allocates by what it says ------------------

struct VdbGrid {
  std::string name, type;
  std::uint32_t compression = 0;
  std::uint64_t tree = 0;   // where its topology begins; 0: behind a transform not known here
  std::uint64_t block = 0;  // where its buffers begin
  std::uint64_t end = 0;
};
struct VdbLayout {
  std::uint64_t size = 0;              // of the file
  std::vector<VdbGrid> grids;          // all of them, where the file tells their places
  std::optional<std::int32_t> format;  // hapsix_format, where the first grid has one
};
// Every length in the head of the file and of its grids fits into the file, and places rise.
Result<VdbLayout> scan_vdb(const std::filesystem::path& file);

// ---- field_file.cpp -----------------------------------------------------------------------------

// All grids of a stream, which goes on with zeros behind its end (see there); `name` stands in the
// sentence.
Result<openvdb::GridPtrVec> read_grids(std::streambuf& bytes, const std::string& name);
inline Failure damaged_field(const std::string& name) {
  return {name + " is a damaged field: bake it again"};
}
inline Failure broken_seal(const std::string& name) {
  return {name + " is a damaged field (its checksum differs): bake it again"};
}

// ---- foreign.cpp: a level set somebody else made ------------------------------------------

Result<FieldData> foreign_field(const openvdb::GridPtrVec& grids, const std::string& name);

// ---- stored.cpp: uncompressed fields, at the speed of the disk ----------------------------

Outcome write_stored(const std::filesystem::path& file, const FieldData& field);
// True for files that write_stored made, as far as the head tells.
bool is_stored(const VdbLayout& layout);
// Nothing: not laid out as write_stored does it, OpenVDB may know more. `file` stands in sentences.
Result<std::optional<FieldData>> read_stored(const std::filesystem::path& file,
                                             const VdbLayout& layout);

}  // namespace h6::io
