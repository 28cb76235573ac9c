// SPDX-License-Identifier: Apache-2.0
// formats.h - what the readers of the mesh formats share. Inside io only.
//
// STL, OBJ and PLY are read here and not by a package: assimp 5.2 takes ten to twenty times as long
// (1.8 M triangles, welded: 3.8, 3.2, 1.4 s against 0.2, 0.35, 0.15), reads 1e400, NaN and PLY
// faces that name missing vertices without a word, and cannot name the line, byte or triangle that
// is wrong. glTF and COLLADA, trees of nodes with transforms, are read here too: assimp follows a
// COLLADA node that holds itself until the stack ends, and crashes on 5 of 2,000 small mutations of
// a tetrahedron's file.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh/mesh.h"

namespace h6::io {

// Thrown by the readers below, caught by parse_mesh and read_mesh, which return the sentence.
struct BadMesh {
  std::string sentence;
};

struct MeshSource {
  std::string_view bytes;  // of the whole file, inflated
  std::string name;        // stands in every sentence
  double scale;            // metres in the file's unit of length
  // Of the file, for files it names; null: it came as bytes, and nothing is beside it.
  const std::filesystem::path* folder = nullptr;

  // "name, place: what."
  [[noreturn]] void fail(const std::string& place, const std::string& what) const;
  [[noreturn]] void fail(const std::string& what) const;
};

// Points and faces as a file lists them, before the weld.
struct Polygons {
  std::vector<Vec3> points;            // [m]
  std::vector<std::uint32_t> corners;  // indices into points, face by face; in range
  std::vector<std::uint32_t> sizes;    // (faces) corners of each, at least 3
  std::vector<std::int32_t> part;      // (faces) or empty
  std::vector<std::string> part_names;
};

Mesh read_stl(const MeshSource& source);
Mesh read_obj(const MeshSource& source);
Mesh read_ply(const MeshSource& source);
Mesh read_gltf(const MeshSource& source);  // .gltf and .glb, told apart by their first bytes
Mesh read_collada(const MeshSource& source);

// Throws if the file cannot be the STL it says it is: from its first bytes (84 are enough) and its
// size, before the rest is read.
void check_stl_size(std::string_view head, std::uint64_t size, const MeshSource& source);

// The first `count` bytes (fewer if it is shorter) of a file that the mesh names: in the mesh's
// folder or below it, never above, elsewhere or in a network.
std::string read_beside(const MeshSource& source, const std::string& name, std::uint64_t count);

// Cuts the faces into triangles, in order, and welds.
Mesh assemble(Polygons&& polygons, const MeshSource& source);

[[noreturn]] void fail_coordinate(const MeshSource& source, const std::string& place, double value);

// A coordinate in the file's unit, in metres; throws unless it is finite and within 1e6 m.
// `place()` is called for the sentence only.
template <class Place>
double coordinate(const MeshSource& source, double value, const Place& place) {
  const double metres = value * source.scale + 0.0;  // + 0.0: no minus zero
  if (!(metres >= -1e6 && metres <= 1e6)) fail_coordinate(source, place(), value);
  return metres;
}

}  // namespace h6::io
