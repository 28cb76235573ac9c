// SPDX-License-Identifier: Apache-2.0
// grids.h - a field as OpenVDB grids. Inside io/field only.
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

// hapsix_format. 3: sealed by XXH3. 4: the same with finer samples, which readers of 3 would lose.
inline constexpr std::int32_t kFieldFormat = 3, kRefinedFormat = 4;
inline bool reads_format(std::int32_t f) { return f == kFieldFormat || f == kRefinedFormat; }

// Numbers the cells of a box of bricks, or the nodes of its far grid, x fastest.
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

// ---- grids.cpp: fields of hapsix ------------------------------------------------------------

// `distance` and `far`, and `part` and `triangle` where the field has them.
openvdb::GridPtrVec grids_of(const FieldData& field);
// The field that the grids hold; no value unless they are a complete field of this format.
std::optional<FieldData> field_of(const openvdb::GridPtrVec& grids);
// Whether hapsix wrote one of the grids, in any version of its format.
bool are_ours(const openvdb::GridPtrVec& grids);

// The transform of a grid whose nodes are `spacing` [m] apart.
openvdb::math::Transform::Ptr transform_of(const FieldData& field, double spacing);

// ---- fine_grids.cpp: the finer samples of fields of hapsix ----------------------------------

void add_fine_grids(const FieldData& field, openvdb::GridPtrVec& grids);
// Takes them into a field that has its bricks. False where they are not whole; true where the grids
// have none.
bool take_fine_grids(const openvdb::GridPtrVec& grids, FieldData& field);

// ---- scan.cpp: checks a file before OpenVDB allocates by its lengths ------------------------

// Fails unless every length in the heads of the file and of its grids fits into the file, and the
// grids' places rise. Returns hapsix_format of the first grid, if it has one.
Result<std::optional<std::int32_t>> scan_vdb(const std::filesystem::path& file);

// ---- foreign.cpp: a level set of another program --------------------------------------------

Result<FieldData> foreign_field(const openvdb::GridPtrVec& grids, const std::string& name);

}  // namespace h6::io
