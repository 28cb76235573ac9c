// SPDX-License-Identifier: Apache-2.0
// field_mesh.h - the mesh that a field was baked from, with rays for those who ask.
#pragma once
#include <memory>
#include <mutex>

#include "hapsix/result.h"
#include "io/mesh/mesh.h"
#include "io/mesh/ray_scene.h"

namespace h6::io {

class FieldMesh {
 public:
  explicit FieldMesh(const Mesh& mesh) : mesh_(mesh) {}  // the mesh must outlive this
  const Mesh& mesh() const { return mesh_; }
  // Made at the first call, because most runs need none. Any thread may call.
  const Result<std::unique_ptr<RayScene>>& rays() const {
    std::call_once(once_, [this] { rays_ = RayScene::make(mesh_); });
    return rays_;
  }

 private:
  const Mesh& mesh_;
  mutable std::once_flag once_;
  mutable Result<std::unique_ptr<RayScene>> rays_ = Failure{"no rays were made"};
};

}  // namespace h6::io
