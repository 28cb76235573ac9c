// SPDX-License-Identifier: Apache-2.0
// mesh_file.h - reads STL (ascii, binary), OBJ, PLY, glTF (.gltf, .glb) and COLLADA (.dae), each
// also as .gz.
#pragma once
#include <filesystem>
#include <string>

#include "hapsix/result.h"
#include "io/mesh/mesh.h"

namespace h6::io {

enum class Unit { m, mm, cm, in };
double metres(Unit unit);
const char* unit_name(Unit unit);  // "m", "mm", "cm", "in"
Result<Unit> unit_from_name(const std::string& name);

// One sentence and no mesh when the file is missing, empty, not what its name says, truncated,
// holds a coordinate that is not finite or beyond 1e6 m, or has no triangle. A remark asks for the
// unit where metres were assumed and make it larger than 20 m. The sentence names file and place
// (byte, line, triangle or vertex number). Triangles keep the file's order; polygons are cut in
// place, concave ones too. Parts are the `o` and `g` of an OBJ ("object/group"), the solids of a
// text STL and the nodes of glTF and COLLADA, whose transforms are applied; axes stay the file's
// own. A glTF is in metres and a COLLADA in its own <unit>: `unit` counts only for one that has
// none, and a remark in the mesh says so. Nothing is dropped silently: a face that cannot be used
// is an error, and so are data behind the last triangle a header announces (fewer than 50 bytes
// behind a binary STL, and blanks or zeros behind a PLY, are padding).
Result<Mesh> read_mesh(const std::filesystem::path& file, Unit unit = Unit::m);

// The same from bytes; `name` decides the format by its ending and stands in the sentence. Files
// beside a .gltf are out of reach.
Result<Mesh> parse_mesh(const std::string& bytes, const std::string& name, Unit unit = Unit::m);

// Binary STL, written aside and renamed.
Outcome write_stl(const std::filesystem::path& file, const Mesh& mesh, Unit unit = Unit::m);

}  // namespace h6::io
