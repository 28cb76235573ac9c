// SPDX-License-Identifier: Apache-2.0
// asset_key.h - the key of a baked asset: a hash of its mesh and of every option of its bake.
#pragma once
#include <string>

#include "io/bake/bake_field.h"
#include "io/file/content_hash.h"
#include "io/shell/bake_shell.h"

namespace h6::io {

// A mesh with the hash of its content. The constructor is the only place that hashes a mesh: make
// one for each mesh, and ask for all its keys with it. The mesh must outlive it, unchanged.
struct HashedMesh {
  explicit HashedMesh(const Mesh& mesh);
  HashedMesh(Mesh&&) = delete;
  const Mesh& mesh;
  const Hash128 hash;
};

// 32 hex digits. Equal bytes of mesh and options (but `threads`) give equal keys. A version number
// in asset_key.cpp changes all keys when a baker gives other results.
std::string asset_key(const HashedMesh& mesh, const FieldBake& options);
std::string asset_key(const HashedMesh& mesh, const ShellBake& options);

}  // namespace h6::io
