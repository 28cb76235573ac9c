// SPDX-License-Identifier: Apache-2.0
// asset_key.h - the key of a baked asset: a hash of its mesh and of every option of its bake.
#pragma once
#include <string>

#include "io/bake/bake_field.h"
#include "io/file/content_hash.h"
#include "io/shell/bake_shell.h"

namespace h6::io {

// A mesh with the hash of its content. Hashing is slow, so make one of these for each mesh and use
// it for all keys of that mesh. The mesh must outlive it and must not change.
struct HashedMesh {
  explicit HashedMesh(const Mesh& mesh);
  HashedMesh(Mesh&&) = delete;
  const Mesh& mesh;
  const Hash128 hash;
};

// Returns 32 hex digits. Equal meshes and equal options give equal keys; `threads` does not count.
// When a baker starts to give other results, a new version number in asset_key.cpp changes all
// keys.
std::string asset_key(const HashedMesh& mesh, const FieldBake& options);
std::string asset_key(const HashedMesh& mesh, const ShellBake& options);

}  // namespace h6::io
