// SPDX-License-Identifier: Apache-2.0
// asset_hash.h - hashes the data of a field, a shell or a model that the engine uses.
//
// The input hash in a baked file does not prove what the file holds now; this hash does. It has 128
// bits, written as 32 hex digits. Names of parts and the history do not enter it.
#pragma once
#include <string>

#include "io/deform/reduced_model.h"
#include "io/field/field_data.h"
#include "io/shell/shell_data.h"

namespace h6::io {

std::string asset_hash(const FieldData& field);
std::string asset_hash(const ShellData& shell);
// The hash of a shell that bends: of the rigid shell's hash and the model by which it bends.
std::string asset_hash(const std::string& shell, const ReducedModel& bends);

}  // namespace h6::io
