// SPDX-License-Identifier: Apache-2.0
// mesh_unit.h - reads a mesh in the unit that the user states, and asks for it where metres, the
// default, would make it larger than any part.
#pragma once
#include <string>

#include "hapsix/result.h"
#include "io/bake/bake_field.h"
#include "io/console/console.h"
#include "io/mesh/mesh_file.h"

namespace h6::cli {

// `units` is the unit's name, checked by the parser. If it was not stated and the mesh is more than
// 20 m across in metres, the user is asked for it at a terminal, and `units` changes to the answer;
// elsewhere the mesh is refused in one sentence.
Result<io::Mesh> read_in_unit(const Console& console, const std::string& file, bool stated,
                              std::string& units);

// The options with their lengths, which the command line has in this unit, in metres.
io::FieldBake in_metres(io::FieldBake options, const std::string& units);

}  // namespace h6::cli
