// SPDX-License-Identifier: Apache-2.0
// gltf_container.h - unpacks a glTF: the chunks of a .glb, base64 and percent codes.
#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "io/mesh/formats.h"

namespace h6::io {

struct GltfContainer {
  std::string_view text;                 // JSON, small and flat enough to be parsed
  std::optional<std::string_view> blob;  // the chunk BIN of a .glb
};

// Files that do not begin as a .glb are taken for JSON.
GltfContainer open_gltf(const MeshSource& source);

std::string decode_base64(std::string_view text, const MeshSource& source);
std::string decode_percent(const std::string& uri);  // "a%20b" -> "a b"

}  // namespace h6::io
