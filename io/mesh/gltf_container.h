// SPDX-License-Identifier: Apache-2.0
// gltf_container.h - what a glTF is packed in: a .glb's chunks, base64 and percent signs.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "io/mesh/formats.h"

namespace h6::io {

struct GltfContainer {
  std::string_view text;                 // JSON, of a size and depth that can be parsed
  std::optional<std::string_view> blob;  // the chunk BIN of a .glb
};

// A .glb is known by its first bytes, whatever its name; everything else is taken for JSON.
GltfContainer open_gltf(const MeshSource& source);

std::string decode_base64(std::string_view text, const MeshSource& source);
std::string decode_percent(const std::string& uri);  // "a%20b" -> "a b"

}  // namespace h6::io
