// SPDX-License-Identifier: Apache-2.0
// guess.h - what mesh files mostly do not say: their unit of length and their up axis.
#pragma once
#include <filesystem>
#include <string>

#include "io/mesh/mesh_file.h"
#include "io/scene/scene.h"

namespace h6::io {

struct UnitGuess {
  Unit unit;
  std::string why;  // completes "mm, because ..."
};
// `longest` is the longest side of all meshes, as the numbers of the files. A unit in a file's name
// ("bay_mm.stl", "counter.unitsmm.stl") decides; else numbers below 4 are metres and others are
// millimetres, since what a hand moves is longer than 4 mm and shorter than 4 m.
UnitGuess guess_unit(const std::vector<std::filesystem::path>& files, double longest);

struct UpGuess {
  UpAxis up;
  std::string why;
};
// z, unless the file is a glTF (y by its standard), or the mesh stands on a flat base across y that
// is at least half as large again as its flat faces across z.
UpGuess guess_up(const std::filesystem::path& file, const Mesh& mesh);

}  // namespace h6::io
