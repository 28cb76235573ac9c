// SPDX-License-Identifier: Apache-2.0
// load_scene.h - turns a scene into engine objects: the model with all assets, and the definitions
// of bodies and hands.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"
#include "io/deform/reduced_model.h"
#include "io/file/progress.h"
#include "io/scene/field_mesh.h"
#include "io/scene/scene.h"

namespace h6::io {

// One field or shell. Bodies with the same content share it.
struct LoadedAsset {
  std::string body;  // the first body that uses it
  bool is_field = false;
  std::string hash;  // asset_key of a mesh; asset_hash of a file or points
  bool from_cache = false;
  bool rebuilt = false;        // its cache file was damaged or held another asset
  double seconds = 0;          // time to bake or read it [s]
  double voxel_size = 0;       // field [m]
  double finest = 0;           // field: its finest voxel, in which depths are measured [m]
  double tolerance = 0;        // field: of its bake [m]; 0: none
  h6Vec3 origin{};             // field: its first node, mesh frame [m]
  std::array<int, 3> nodes{};  // field: nodes per axis
  std::size_t bricks = 0;      // field
  std::size_t points = 0;      // shell
  int levels = 0;              // shell
  std::size_t modes = 0;       // shell that bends; 0: rigid
  double lowest_hz = 0;        // shell that bends: of its slowest small vibration [Hz]
};

struct ModelDeleter {
  void operator()(h6Model* model) const { h6DestroyModel(model); }
};

struct LoadedScene {
  Scene scene;
  std::unique_ptr<h6Model, ModelDeleter> model;
  std::vector<h6BodyDef> bodies;                  // in the order of scene.bodies
  std::vector<h6HandDef> hands;                   // in the order of scene.hands
  std::vector<std::vector<h6Vec3>> shell_points;  // of each shell of the model, mesh frame [m]
  // The mesh of each field of the model; null for a field that came from a file. Some of the meshes
  // are in `scene`, the others in `meshes`.
  std::vector<std::unique_ptr<FieldMesh>> field_meshes;
  std::vector<double> field_voxels;                        // the finest of each field [m]
  std::vector<std::unique_ptr<const ReducedModel>> bends;  // by body; null where it is rigid
  std::vector<std::unique_ptr<const Mesh>> meshes;
  std::vector<LoadedAsset> assets;
  std::vector<std::string> warnings;
  h6Allocator allocator{};  // of the model and of sessions; zero: the C library's

  int body_index(const std::string& name) const;
  const std::vector<h6Vec3>& watched_points() const;  // shell of the first hand's body
  double duration() const;  // of the scene; if it has none, of its longest path [s]
  // The result points at `bodies` and `hands`.
  h6SessionDef session_def() const;
};

// Reads and bakes all assets, then builds the model. An error names the body and the file.
Result<std::unique_ptr<LoadedScene>> load_scene(Scene scene, const Progress& progress = {},
                                                const h6Allocator& allocator = {});

}  // namespace h6::io
