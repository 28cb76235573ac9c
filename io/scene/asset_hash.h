// SPDX-License-Identifier: Apache-2.0
// asset_hash.h - a fingerprint of a field or shell as the engine gets it, whatever it came from.
//
// What a baked file says it was baked from proves nothing about what is in it now. 128 bits as 32
// hex digits; names of parts and how it was made do not count.
#pragma once
#include <string>

#include "io/field/field_data.h"
#include "io/shell/shell_data.h"

namespace h6::io {

std::string asset_hash(const FieldData& field);
std::string asset_hash(const ShellData& shell);

}  // namespace h6::io
