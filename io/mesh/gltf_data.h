// SPDX-License-Identifier: Apache-2.0
// gltf_data.h - the JSON of a glTF and the bytes of its accessors. Inside io/mesh only.
//
// Every member, index, offset and count is checked before it is used. Failures throw BadMesh with
// the place in the file.
#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/mesh/gltf_container.h"

namespace h6::io {

// The elements of an accessor, all within its buffer; the count is then no larger than the file.
struct GltfColumn {
  std::string_view bytes;  // from the first element to the end of the last one
  std::uint64_t count = 0, stride = 0, type = 0;
  bool normalized = false;
  double real(std::uint64_t row, std::uint64_t axis) const;
  std::uint32_t whole(std::uint64_t row) const;
};

class GltfData {
 public:
  using Json = nlohmann::json;
  // Both must outlive it.
  GltfData(const MeshSource& source, const GltfContainer& file);

  [[noreturn]] void fail(const std::string& place, const std::string& what) const {
    source_.fail(place, what);
  }
  const Json& root() const { return root_; }
  // A list of the root, empty when absent, and an object in it. `from` names it.
  const Json& list(const char* key) const;
  const Json& item(const char* key, std::uint64_t index, const std::string& from) const;
  static std::string at(const char* key, std::uint64_t index);  // "nodes 7"

  // Whole numbers, not below 0.
  std::uint64_t natural(const Json& value, const std::string& place, const char* key) const;
  std::uint64_t need(const Json& object, const char* key, const std::string& place) const;
  std::uint64_t natural_or(const Json& object, const char* key, std::uint64_t otherwise,
                           const std::string& place) const;
  // N numbers, or nothing when the member is absent.
  template <std::size_t N>
  std::optional<std::array<double, N>> numbers(const Json& object, const char* key,
                                               const std::string& place) const {
    const auto found = object.find(key);
    if (found == object.end()) return std::nullopt;
    std::array<double, N> out{};
    bool good = found->is_array() && found->size() == N;
    for (std::size_t i = 0; good && i < N; ++i) {
      good = (*found)[i].is_number();
      if (good) out[i] = (*found)[i].template get<double>();
    }
    if (!good) fail(place, "'" + std::string(key) + "' must be " + std::to_string(N) + " numbers");
    return out;
  }
  static std::string name_of(const Json& object);  // "" when it has none
  // Whether an object uses an extension.
  static bool uses(const Json& object, const char* extension);

  // Fails unless the accessor is of this `type`, which has `width` numbers.
  GltfColumn accessor(std::uint64_t index, const char* type, std::uint64_t width,
                      const std::string& from);

 private:
  void check_version() const;
  std::string_view buffer(std::uint64_t index, const std::string& from);
  std::string_view buffer_bytes(const Json& entry, std::uint64_t index, std::uint64_t length,
                                const std::string& place);
  std::string_view keep(std::string&& bytes);
  std::uint64_t component_size(std::uint64_t type, const std::string& place) const;

  const MeshSource& source_;
  const GltfContainer& file_;
  const Json root_;
  std::map<std::uint64_t, std::string_view> buffers_;
  std::vector<std::unique_ptr<std::string>> owned_;
};

}  // namespace h6::io
