// SPDX-License-Identifier: Apache-2.0
// ply_header.h - the header of a PLY file.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "io/mesh/formats.h"

namespace h6::io {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
std::size_t size_of(PlyType type);
bool is_integer(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type;
  bool list = false;
  PlyType count_type = PlyType::uint8;  // of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  enum class Form { ascii, little_endian, big_endian } form = Form::ascii;
  std::vector<PlyElement> elements;
  std::size_t lines = 0;  // of the header
  std::size_t body = 0;   // first byte behind it
};

// Throws BadMesh naming the line.
PlyHeader read_ply_header(const MeshSource& source);

}  // namespace h6::io
