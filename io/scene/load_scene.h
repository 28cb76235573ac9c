// SPDX-License-Identifier: Apache-2.0
// load_scene.h - makes of a scene what the engine runs: the model with all assets, and the
// definitions of bodies and hands.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"
#include "io/file/progress.h"
#include "io/scene/scene.h"

namespace h6::io {

// One field or shell. Bodies with the same content share it.
struct LoadedAsset {
  std::string body;  // the first that uses it
  bool is_field = false;
  std::string hash;  // asset_key of a mesh; asset_hash of a file or points
  bool from_cache = false;
  bool rebuilt = false;        // its file in the cache was damaged or of something else
  double seconds = 0;          // to bake or to read it
  double voxel_size = 0;       // field [m]
  h6Vec3 origin{};             // field: its first node, mesh frame [m]
  std::array<int, 3> nodes{};  // field: per axis
  std::size_t bricks = 0;      // field
  std::size_t points = 0;      // shell
  int levels = 0;              // shell
};

struct ModelDeleter {
  void operator()(h6Model* model) const { h6DestroyModel(model); }
};

struct LoadedScene {
  Scene scene;
  std::unique_ptr<h6Model, ModelDeleter> model;
  std::vector<h6BodyDef> bodies;       // as scene.bodies
  std::vector<h6HandDef> hands;        // as scene.hands
  std::vector<h6Vec3> watched_points;  // shell of the first hand's body, mesh frame [m]
  std::vector<LoadedAsset> assets;
  std::vector<std::string> warnings;

  int body_index(const std::string& name) const;
  double duration() const;  // the scene's, or that of its longest path [s]
  // It points at bodies and hands of this object.
  h6SessionDef session_def() const;
};

// Reads, bakes and converts. An error names the body and the file.
Result<std::unique_ptr<LoadedScene>> load_scene(Scene scene, const Progress& progress = {});

}  // namespace h6::io
