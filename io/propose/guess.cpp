// SPDX-License-Identifier: Apache-2.0
#include "io/propose/guess.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <optional>

#include "hapsix/vector.h"

namespace h6::io {
namespace {

constexpr double kLongestInMetres = 4;

std::string lower_name(const std::filesystem::path& file) {
  std::string name = file.filename().string();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

bool ends_in(const std::string& name, const std::string& ending) {
  return name.ends_with(ending) || name.ends_with(ending + ".gz");
}

// A word of the name that is a unit: "bay_mm.stl", "bay.unitsmm.stl", but not "peg_16mm.stl".
std::optional<Unit> unit_in_name(const std::string& name) {
  std::string word;
  for (const char c : name + ".") {
    if (std::isalnum(static_cast<unsigned char>(c))) {
      word += c;
      continue;
    }
    if (word.starts_with("units")) word.erase(0, 5);
    if (word == "mm" || word == "millimeters" || word == "millimetres") return Unit::mm;
    if (word == "cm") return Unit::cm;
    if (word == "inch" || word == "inches") return Unit::in;
    if (word == "meters" || word == "metres") return Unit::m;
    word.clear();
  }
  return std::nullopt;
}

std::string text(const char* pattern, auto... values) {
  char out[200];
  std::snprintf(out, sizeof out, pattern, values...);
  return out;
}

// The area of the triangles that face along -axis or +axis in the outermost hundredth of the mesh,
// the larger of both sides [m^2].
double flat_face(const Mesh& mesh, const MeshBounds& box, double Vec3::*axis) {
  const double low = box.low.*axis, high = box.high.*axis, near = 0.01 * (high - low);
  std::array<double, 2> area{};
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]], b = mesh.vertices[t[1]], c = mesh.vertices[t[2]];
    const Vec3 n = cross(b - a, c - a);
    const double size = norm(n);
    if (!(size > 0) || std::abs(n.*axis) < 0.98 * size) continue;
    const double least = std::min({a.*axis, b.*axis, c.*axis}),
                 most = std::max({a.*axis, b.*axis, c.*axis});
    if (most <= low + near) area[0] += size / 2;
    if (least >= high - near) area[1] += size / 2;
  }
  return std::max(area[0], area[1]);
}

}  // namespace

UnitGuess guess_unit(const std::vector<std::filesystem::path>& files, double longest) {
  for (const std::filesystem::path& file : files)
    if (const auto named = unit_in_name(lower_name(file)))
      return {*named, "'" + file.filename().string() + "' says so in its name"};
  if (longest < kLongestInMetres)
    return {Unit::m, text("the longest side is %.3g in the files, and %.3g mm would be too small "
                          "to hold",
                          longest, longest)};
  return {Unit::mm,
          text("the longest side is %.4g in the files, and %.4g m would be too large to hold",
               longest, longest)};
}

UpGuess guess_up(const std::filesystem::path& file, const Mesh& mesh) {
  const std::string name = lower_name(file);
  if (ends_in(name, ".gltf") || ends_in(name, ".glb")) return {UpAxis::y, "glTF files have it so"};
  const MeshBounds box = bounds_of(mesh);
  const double y = flat_face(mesh, box, &Vec3::y), z = flat_face(mesh, box, &Vec3::z);
  if (y > 0 && y >= 1.5 * z)
    return {UpAxis::y, text("the environment stands on a flat face of %.3g cm2 across y", 1e4 * y)};
  return {UpAxis::z,
          z > 0 ? "the environment stands on a flat face across z" : "CAD mostly has it so"};
}

}  // namespace h6::io
