// SPDX-License-Identifier: Apache-2.0
// shell_file.h - shells as binary PLY: `vertex` with nx ny nz radius level first_child child_count
// triangle, and `node` with the whole sphere tree. Other programs show the vertices.
//
//   comment hapsix shell 1            version of the format
//   comment units metres
//   comment input_hash 0123...        of the mesh and the bake parameters
//   comment level_first 0 6 31 ...    first row of each level in `node`, and the end
//   element vertex   float x y z nx ny nz radius, uchar level (0 is coarsest),
//                    uint first_child child_count triangle
//   element node     uint point, float radius, uint first_child child_count
//
// radius, first_child and child_count of a vertex are those of its node on its own level. They
// repeat `node` for other programs.
#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "hapsix/result.h"
#include "io/shell/shell_data.h"

namespace h6::io {

// Written aside, then renamed. Refuses a shell that read_shell would refuse.
Outcome write_shell(const std::filesystem::path& file, const ShellData& shell);

// A shell of this program is read back bit for bit, or fails: all that h6ShellDef promises is
// checked. A .ply with x y z nx ny nz and no `node` element, binary or text, gets its tree on
// reading. Its normals must point INTO the body, as ours do; nothing in a point cloud shows which
// way they point.
Result<ShellData> read_shell(const std::filesystem::path& file);

// The same from bytes; failures name them `name`.
Result<ShellData> parse_shell(std::string_view bytes, const std::string& name);

}  // namespace h6::io
