// SPDX-License-Identifier: Apache-2.0
// field_file.h - fields as OpenVDB files: grids `distance`, `far`, `part` and `triangle`, with the
// history of the bake as metadata.
#pragma once
#include <filesystem>

#include "hapsix/result.h"
#include "io/field/field_data.h"

namespace h6::io {

enum class Compression { none, blosc };

// Written aside, then renamed. The rows must be in the order of cells, as bake_field makes them:
// a file does not keep another order.
Outcome write_field(const std::filesystem::path& file, const FieldData& field,
                    Compression compression = Compression::blosc);
// The distance alone, as a level set of floats without our metadata: programs that know no grids of
// integers read it (pyopenvdb.readAll), and read_field reads it as that of another program.
Outcome write_level_set(const std::filesystem::path& file, const FieldData& field);
// Fields of this program are read back bit for bit; fields of another version are refused. A .vdb
// of another program is read when it has one level set of floats: from its narrow band and
// background come safe distances beside the band and a far grid of safe bounds (foreign.cpp).
Result<FieldData> read_field(const std::filesystem::path& file);

}  // namespace h6::io
