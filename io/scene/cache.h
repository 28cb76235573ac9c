// SPDX-License-Identifier: Apache-2.0
// cache.h - baked assets by content: the same mesh and parameters are never baked twice.
#pragma once
#include <filesystem>
#include <string>

#include "hapsix/result.h"
#include "io/bake/bake_field.h"
#include "io/shell/bake_shell.h"

namespace h6::io {

// $HAPSIX_CACHE, else $XDG_CACHE_HOME/hapsix, else ~/.cache/hapsix; empty when none is set.
// Assets are KEY.vdb and KEY.ply there.
std::filesystem::path cache_folder();

// 128-bit hash as 32 hex digits of content and parameters: the key of a cached asset. The same
// bytes of mesh and options (threads aside) give the same key; a change of the bakers themselves
// changes all keys by a version number (asset_key.cpp).
std::string content_hash(const Mesh& mesh, const FieldBake& options);
std::string content_hash(const Mesh& mesh, const ShellBake& options);

// From the cache, or baked and put there. A damaged or foreign file there is rebuilt, saying so in
// `warnings`; a cache that cannot be written is a warning, not an error.
struct Cached {
  bool hit = false;
  bool rebuilt = false;  // a file was there, but of no use
  std::filesystem::path file;
  std::vector<std::string> warnings;
};
Result<FieldData> cached_field(const Mesh& mesh, const FieldBake& options, Cached* cached,
                               const Progress& progress = {});
Result<ShellData> cached_shell(const Mesh& mesh, const ShellBake& options, Cached* cached,
                               const Progress& progress = {});

}  // namespace h6::io
