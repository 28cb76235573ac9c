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

// Fails when the file is missing, empty, truncated, of another format than its name says, has no
// triangle, or has a coordinate that is not finite or beyond 1e6 m. The sentence names the file and
// the place (byte, line, triangle or vertex number).
//
// Triangles keep the file's order; polygons, concave ones too, are cut where they stand. Parts are
// the `o` and `g` of an OBJ ("object/group"), the solids of a text STL, and the nodes of glTF and
// COLLADA, whose transforms are applied. Axes stay the file's own.
//
// A glTF is in metres and a COLLADA in its own <unit>; `unit` counts only for a COLLADA without
// one, and a remark in the mesh says so. A remark also asks for the unit when metres were assumed
// and the mesh is larger than 20 m.
//
// Nothing is dropped silently. A face that cannot be used is an error, and so are data after the
// last triangle of a header's count, except padding: fewer than 50 bytes after a binary STL, blanks
// or zeros after a PLY.
Result<Mesh> read_mesh(const std::filesystem::path& file, Unit unit = Unit::m);

// Whether the ending of the name is that of a mesh, with or without .gz.
bool is_mesh_name(const std::string& name);
// Whether files of that format have a unit of length of their own, as glTF and COLLADA do.
bool states_unit(const std::string& name);

// The same from bytes. The ending of `name` decides the format. Files beside a .gltf are not read.
Result<Mesh> parse_mesh(const std::string& bytes, const std::string& name, Unit unit = Unit::m);

// Binary STL, written aside and renamed.
Outcome write_stl(const std::filesystem::path& file, const Mesh& mesh, Unit unit = Unit::m);

}  // namespace h6::io
