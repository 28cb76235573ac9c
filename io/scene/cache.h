// SPDX-License-Identifier: Apache-2.0
// cache.h - the cache of baked assets: equal meshes and options are baked once.
#pragma once
#include <filesystem>
#include <string>

#include "hapsix/result.h"
#include "io/scene/asset_key.h"

namespace h6::io {

// $HAPSIX_CACHE, else $XDG_CACHE_HOME/hapsix, else ~/.cache/hapsix; empty when none is set. It
// holds KEY.field and KEY.ply.
std::filesystem::path cache_folder();

// How an asset was obtained.
struct Cached {
  bool hit = false;
  bool rebuilt = false;  // its file was damaged or of something else
  std::filesystem::path file;
  std::vector<std::string> warnings;
};

// From the cache, or baked and put there. A file of no use is replaced, with a warning. A cache
// that cannot be written gives a warning, not an error. `cached` may be null.
Result<FieldData> cached_field(const HashedMesh& mesh, const FieldBake& options, Cached* cached,
                               const Progress& progress = {});
Result<ShellData> cached_shell(const HashedMesh& mesh, const ShellBake& options, Cached* cached,
                               const Progress& progress = {});

}  // namespace h6::io
