// SPDX-License-Identifier: Apache-2.0
// asset_hash.h - a fingerprint of the data of a field or shell, as the engine gets them.
//
// The input hash in a baked file does not prove what the file holds now; this hash does. It has 128
// bits, as 32 hex digits, and leaves out the names of parts and the history.
#pragma once
#include <string>

#include "io/field/field_data.h"
#include "io/shell/shell_data.h"

namespace h6::io {

std::string asset_hash(const FieldData& field);
std::string asset_hash(const ShellData& shell);

}  // namespace h6::io
