// SPDX-License-Identifier: Apache-2.0
// node_files.h - small glTF and COLLADA files for the tests of their readers.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "tests/io/mesh/mesh_samples.h"

namespace node_files {

inline std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[three >> (18 - 6 * k) & 63];
  }
  return out;
}

// Points as floats, then triangles as uint16.
inline std::string buffer(const samples::Mesh& mesh) {
  std::string out;
  for (const auto& p : mesh.vertices)
    for (const double x : {p.x, p.y, p.z}) samples::put(out, static_cast<float>(x));
  for (const auto& t : mesh.triangles)
    for (const auto v : t) samples::put(out, static_cast<std::uint16_t>(v));
  return out;
}

inline std::string data_uri(const std::string& bytes) {
  return "data:application/octet-stream;base64," + base64(bytes);
}

// One mesh "drawn". `nodes` is the JSON list; the scene shows node 0. An empty `uri` means the
// chunk of a .glb.
inline std::string gltf(const samples::Mesh& mesh, const std::string& nodes, const std::string& uri,
                        const std::string& more = "") {
  const std::size_t points = 12 * mesh.vertices.size(), corners = 3 * mesh.triangles.size();
  const auto number = [](std::size_t n) { return std::to_string(n); };
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":)" + nodes +
         R"(,"meshes":[{"name":"drawn","primitives":[{"attributes":{"POSITION":0},"indices":1}]}],)" +
         R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
         number(mesh.vertices.size()) +
         R"(},{"bufferView":1,"componentType":5123,"type":"SCALAR","count":)" + number(corners) +
         R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + number(points) +
         R"(},{"buffer":0,"byteOffset":)" + number(points) + R"(,"byteLength":)" +
         number(2 * corners) + R"(}],"buffers":[{"byteLength":)" + number(points + 2 * corners) +
         (uri.empty() ? "" : R"(,"uri":")" + uri + "\"") + "}]" + more + "}";
}

inline std::string glb(std::string text, std::string blob) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  blob.resize((blob.size() + 3) / 4 * 4, '\0');
  std::string out = "glTF";
  samples::put(out, std::uint32_t{2});
  samples::put(out, static_cast<std::uint32_t>(28 + text.size() + blob.size()));
  samples::put(out, static_cast<std::uint32_t>(text.size()));
  out += "JSON" + text;
  samples::put(out, static_cast<std::uint32_t>(blob.size()));
  return out + std::string("BIN\0", 4) + blob;
}

// One geometry "drawn" with id g. `asset`, `nodes` and `library` (of nodes) are XML.
inline std::string dae(const samples::Mesh& mesh, const std::string& asset,
                       const std::string& nodes, const std::string& library = "") {
  std::string points, corners;
  for (const auto& p : mesh.vertices) points += samples::text(p) + " ";
  for (const auto& t : mesh.triangles)
    for (const auto v : t) corners += std::to_string(v) + " 0 ";  // and one normal for all
  const std::string n = std::to_string(mesh.vertices.size());
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- a comment -->\n<COLLADA "
         "version=\"1.4.1\">"
         "<asset>" +
         asset +
         "</asset>\n<library_geometries><geometry id=\"g\" name=\"drawn\"><mesh>\n"
         "<source id=\"p\"><float_array id=\"a\" count=\"" +
         std::to_string(3 * mesh.vertices.size()) + "\">" + points +
         "</float_array>\n<technique_common><accessor source=\"#a\" count=\"" + n +
         "\" stride=\"3\"><param name=\"X\"/><param name=\"Y\"/><param name=\"Z\"/></accessor>"
         "</technique_common></source>\n"
         "<vertices id=\"v\"><input semantic=\"POSITION\" source=\"#p\"/></vertices>\n"
         "<triangles count=\"" +
         std::to_string(mesh.triangles.size()) +
         "\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>"
         "<input semantic=\"NORMAL\" source=\"#n\" offset=\"1\"/><p>" +
         corners + "</p></triangles>\n</mesh></geometry></library_geometries>\n<library_nodes>" +
         library + "</library_nodes>\n<library_visual_scenes><visual_scene id=\"s\">" + nodes +
         "</visual_scene></library_visual_scenes>\n"
         "<scene><instance_visual_scene url=\"#s\"/></scene></COLLADA>\n";
}

}  // namespace node_files
