// SPDX-License-Identifier: Apache-2.0
// shell_file.h - shells as binary PLY: `vertex` with nx ny nz radius level first_child child_count
// triangle, and `node` with the whole sphere tree. Other programs show the vertices.
//
//   comment hapsix shell 1            format of this file
//   comment units metres
//   comment input_hash 0123...        of the mesh and the bake parameters
//   comment level_first 0 6 31 ...    rows of each level in `node`, and the end
//   element vertex   float x y z nx ny nz radius, uchar level (0 is coarsest),
//                    uint first_child child_count triangle
//   element node     uint point, float radius, uint first_child child_count
//
// radius, first_child and child_count of a vertex are those of its first node, on its own level:
// they repeat what `node` says, for other programs.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "hapsix/result.h"
#include "io/shell/shell_data.h"

namespace h6::io {

// Written aside, then renamed. Refuses a shell that read_shell would refuse.
Outcome write_shell(const std::filesystem::path& file, const ShellData& shell);

// Shells of this program come back to the bit, or not at all: whatever h6ShellDef promises is
// checked. A .ply with x y z nx ny nz and no `node` element is taken too, binary or text: the tree
// is built on reading. Its normals must point INTO the body, as ours do; nothing in a cloud tells.
Result<ShellData> read_shell(const std::filesystem::path& file);

// The same from bytes; `name` stands in the sentence.
Result<ShellData> parse_shell(std::string_view bytes, const std::string& name);

}  // namespace h6::io
