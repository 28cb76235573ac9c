// SPDX-License-Identifier: Apache-2.0
// formats.h - what the readers of the mesh formats share. Inside io/mesh only.
//
// No package reads the formats: assimp 5.2 takes ten to twenty times as long (1.8 M triangles,
// welded: 3.8, 3.2 and 1.4 s for STL, OBJ and PLY against 0.2, 0.35 and 0.15), accepts 1e400, NaN
// and faces of missing vertices, cannot name the line or byte that is wrong, and crashes on damaged
// COLLADA files.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh/mesh.h"

namespace h6::io {

// The readers below throw it; parse_mesh and read_mesh catch it and return the sentence.
struct BadMesh {
  std::string sentence;
};

struct MeshSource {
  std::string_view bytes;  // of the whole file, inflated
  std::string name;        // begins every sentence
  double scale;            // metres in the file's unit of length
  // The file's folder, where other files that it names are; null when only bytes were given.
  const std::filesystem::path* folder = nullptr;

  // "name, place: what."
  [[noreturn]] void fail(const std::string& place, const std::string& what) const;
  [[noreturn]] void fail(const std::string& what) const;
};

// Points and faces in the order of the file, before the weld.
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
Mesh read_gltf(const MeshSource& source);  // .gltf and .glb; the first bytes tell which
Mesh read_collada(const MeshSource& source);

// Throws unless the first bytes (84 are enough) and the size fit an STL, so that other files are
// not read whole.
void check_stl_size(std::string_view head, std::uint64_t size, const MeshSource& source);

// The first `count` bytes (fewer if it is shorter) of a file that the mesh names. It must lie in
// the mesh's folder or below.
std::string read_beside(const MeshSource& source, const std::string& name, std::uint64_t count);

// Cuts the faces into triangles, in order, and welds.
Mesh assemble(Polygons&& polygons, const MeshSource& source);

[[noreturn]] void fail_coordinate(const MeshSource& source, const std::string& place, double value);

// Converts a coordinate from the file's unit to metres; throws unless it is finite and within 1e6
// m. `place()` gives the place for the sentence.
template <class Place>
double coordinate(const MeshSource& source, double value, const Place& place) {
  const double metres = value * source.scale + 0.0;  // + 0.0 turns -0 into 0
  if (!(metres >= -1e6 && metres <= 1e6)) fail_coordinate(source, place(), value);
  return metres;
}

}  // namespace h6::io
