// SPDX-License-Identifier: Apache-2.0
// mesh_samples.h - small meshes in every format, for the tests of the readers.
#pragma once
#include <zlib.h>

#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "io/mesh/mesh_file.h"

namespace samples {

using h6::io::Mesh;
using h6::io::Vec3;

// Eight corners, twelve triangles, outward; the coordinates are exact in float.
inline Mesh box(Vec3 low = {-1, -0.5, 0}, Vec3 high = {1, 0.5, 0.25}) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(
        {i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

inline void append(Mesh& to, const Mesh& more) {
  const auto base = static_cast<std::uint32_t>(to.vertices.size());
  to.vertices.insert(to.vertices.end(), more.vertices.begin(), more.vertices.end());
  for (const auto& t : more.triangles)
    to.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

inline std::string text(const Vec3& p) {
  char line[96];
  std::snprintf(line, sizeof line, "%.17g %.17g %.17g", p.x, p.y, p.z);
  return line;
}

template <class T>
void put(std::string& out, T value, bool big = false) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof bytes);
  if (big)
    for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
  out.append(bytes, sizeof bytes);
}

inline std::string stl_text(const Mesh& mesh) {
  std::string out = "solid a name with words\n";
  for (const auto& t : mesh.triangles) {
    out += "  facet normal 0 0 0\n    outer loop\n";
    for (const auto v : t) out += "      vertex " + text(mesh.vertices[v]) + "\n";
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid\n";
}

inline std::string stl_binary(const Mesh& mesh, const std::string& head = "made by a test") {
  std::string out = head;
  out.resize(80, '\0');
  put(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    out.append(12, '\0');
    for (const auto v : t)
      for (const double x : {mesh.vertices[v].x, mesh.vertices[v].y, mesh.vertices[v].z})
        put(out, static_cast<float>(x));
    out.append(2, '\0');
  }
  return out;
}

inline std::string obj(const Mesh& mesh) {
  std::string out = "# a comment\nmtllib none.mtl\no thing\n";
  for (const auto& p : mesh.vertices) out += "v " + text(p) + "\n";
  for (const auto& t : mesh.triangles) {
    out += "f";
    for (const auto v : t) out += " " + std::to_string(v + 1) + "//" + std::to_string(v + 1);
    out += "\n";
  }
  return out;
}

// With columns and elements that a reader must skip.
inline std::string ply(const Mesh& mesh, const std::string& form) {
  std::string out = "ply\nformat " + form + " 1.0\ncomment made by a test\n";
  out += "element camera 1\nproperty list uchar float lens\nproperty short id\n";
  out += "element vertex " + std::to_string(mesh.vertices.size()) +
         "\nproperty uchar red\nproperty double x\nproperty double y\nproperty double z\n";
  out += "element face " + std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nproperty ushort flags\nend_header\n";
  if (form == "ascii") {
    out += "2 0.5 0.25 -7\n";
    for (const auto& p : mesh.vertices) out += "255 " + text(p) + "\n";
    for (const auto& t : mesh.triangles)
      out += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) +
             " 9\n";
    return out;
  }
  const bool big = form == "binary_big_endian";
  put(out, std::uint8_t{2});
  put(out, 0.5f, big);
  put(out, 0.25f, big);
  put(out, std::int16_t{-7}, big);
  for (const auto& p : mesh.vertices) {
    put(out, std::uint8_t{255});
    for (const double x : {p.x, p.y, p.z}) put(out, x, big);
  }
  for (const auto& t : mesh.triangles) {
    put(out, std::uint8_t{3});
    for (const auto v : t) put(out, static_cast<std::int32_t>(v), big);
    put(out, std::uint16_t{9}, big);
  }
  return out;
}

inline std::string gz(const std::string& bytes) {
  z_stream z{};
  deflateInit2(&z, 6, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&z, bytes.size()) + 64, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

struct File {
  std::string name, bytes;
};

inline std::vector<File> every_format(const Mesh& mesh) {
  std::vector<File> files = {{"text.stl", stl_text(mesh)},
                             {"binary.STL", stl_binary(mesh)},
                             {"liar.stl", stl_binary(mesh, "solid but binary")},
                             {"mesh.obj", obj(mesh)},
                             {"text.ply", ply(mesh, "ascii")},
                             {"little.ply", ply(mesh, "binary_little_endian")},
                             {"big.ply", ply(mesh, "binary_big_endian")}};
  const std::size_t plain = files.size();
  for (std::size_t i = 0; i < plain; ++i)
    files.push_back({files[i].name + ".gz", gz(files[i].bytes)});
  return files;
}

inline bool same_bits(const Mesh& a, const Mesh& b) {
  if (a.vertices.size() != b.vertices.size() || a.triangles != b.triangles) return false;
  for (std::size_t i = 0; i < a.vertices.size(); ++i)
    if (std::memcmp(&a.vertices[i], &b.vertices[i], sizeof(Vec3)) != 0) return false;
  return true;
}

}  // namespace samples
