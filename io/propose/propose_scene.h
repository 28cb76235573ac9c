// SPDX-License-Identifier: Apache-2.0
// propose_scene.h - from two or more meshes to a scene that touches: `hapsix new`.
//
//   plan    reads the meshes; units, up axis, voxels, points, stiffness          (plan_scene.cpp)
//   load    the caller bakes the plan's scene, with the part in its given place
//   start   a free start near contact, and a path of the hand that touches       (start_place.cpp)
//   text    the scene as plain JSON, with what is not a default (proposal_text.cpp)
//
// Every choice is told in a sentence.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/propose/free_way.h"
#include "io/scene/load_scene.h"

namespace h6::io {

struct Wanted {
  std::filesystem::path part;
  std::vector<std::filesystem::path> environment;  // at least one
  std::optional<Unit> unit;                        // of the files; by default guessed
  std::optional<UpAxis> up;                        // by default guessed
  unsigned threads = 0;                            // 0: all
};

// One choice: what it is about, and what was chosen and why. "start": "free, 0.4 mm from ...".
struct Chosen {
  std::string about, text;
};

struct ScenePlan {
  Scene scene;  // the part is the last body; poses, and the hand's path, are not decided yet
  std::unique_ptr<FreeWay> way;
  double size = 0;                     // longest side of the part [m]
  double voxel = 0;                    // of the environment's fields, the largest [m]
  double stiffness = 0, coupling = 0;  // k of contacts and of the coupling [N/m]
  std::vector<Chosen> choices;
  std::vector<std::string> warnings;
};

// Reads the meshes and chooses everything but the start.
Result<ScenePlan> plan_scene(const Wanted& wanted);

// Where the part starts, and how its hand moves.
struct StartPlace {
  h6Vec3 shift{};         // of the part from its given place [m]
  bool kept = false;      // in its given place
  bool overlaps = false;  // kept where it overlaps by less than a voxel
  double gap = 0;         // to the nearest obstacle [m]; 0 if it overlaps
  Path path;              // of the hand, from the start; ends in contact
  std::vector<Chosen> choices;
};
// `loaded` is the loaded scene of the plan. Chooses a start and proves with the engine that nothing
// overlaps there; fails if none is found. Leaves the start in `loaded`, or
// `loaded` as it was. `outside`: not in a given place where the parts overlap, even a little.
Result<StartPlace> find_start(const ScenePlan& plan, LoadedScene& loaded, bool outside = false);

// The scene as JSON with what is not a default, short lists on one line. Body `i` has the mesh file
// meshes[i]; the hand follows the path file `path`.
std::string proposal_text(const Scene& scene, const std::vector<std::string>& meshes,
                          const std::string& path);

// The path as CSV in `unit`, rounded to 12 digits.
std::string path_text(const Path& path, Unit unit);

// A length for people [m]: in the unit of the scene, but in mm where that is m.
std::string length_text(double metres_long, Unit unit);
// Rounded to `digits` significant digits.
double rounded(double value, int digits);

}  // namespace h6::io
