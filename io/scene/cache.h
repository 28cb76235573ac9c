// SPDX-License-Identifier: Apache-2.0
// cache.h - keeps baked assets on disk, so that each mesh is baked once with the same options.
#pragma once
#include <filesystem>
#include <string>

#include "hapsix/result.h"
#include "io/deform/reduce.h"
#include "io/scene/asset_key.h"

namespace h6::io {

// Returns $HAPSIX_CACHE, else $XDG_CACHE_HOME/hapsix, else ~/.cache/hapsix; empty when none of the
// variables is set. The folder holds KEY.field, KEY.ply
// and KEY.h5.
std::filesystem::path cache_folder();

// How an asset was obtained.
struct Cached {
  bool hit = false;
  bool rebuilt = false;  // its file was damaged or held another asset
  std::filesystem::path file;
  std::vector<std::string> warnings;
};

// Takes the asset from the cache, or bakes it and stores it there. A file that cannot be used is
// replaced, with a warning. A cache that cannot be written gives a warning, not an error. `cached`
// may be null. Without `keep` nothing is stored.
Result<FieldData> cached_field(const HashedMesh& mesh, const FieldBake& options, Cached* cached,
                               const Progress& progress = {}, bool keep = true);
Result<ShellData> cached_shell(const HashedMesh& mesh, const ShellBake& options, Cached* cached,
                               const Progress& progress = {}, bool keep = true);

// The reduced model of a solid, as KEY.h5.
Result<ReducedModel> cached_bend(const SolidMesh& solid, const ReduceOptions& options,
                                 Cached* cached, const Progress& progress = {});

}  // namespace h6::io
