// SPDX-License-Identifier: Apache-2.0
// field_file.h - fields as OpenVDB files: grids `distance`, `far`, `part` and `triangle`, history
// as metadata.
#pragma once
#include <filesystem>

#include "hapsix/result.h"
#include "io/field/field_data.h"

namespace h6::io {

enum class Compression { none, blosc };  // none: the cache; blosc: exports

// Written aside, then renamed. Rows are put in the order of cells, as bake_field has them.
Outcome write_field(const std::filesystem::path& file, const FieldData& field,
                    Compression compression = Compression::blosc);
// Fields of this program come back to the bit. Any other .vdb with one float level set grid is
// taken
// too: narrow band, background and all; its far grid is then derived, safely.
Result<FieldData> read_field(const std::filesystem::path& file);

}  // namespace h6::io
