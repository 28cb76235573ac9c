// SPDX-License-Identifier: Apache-2.0
// asset_key.cpp - the key of a cached asset: a hash of the mesh and of everything that shapes the
// bake.
#include <cstdint>
#include <type_traits>
#include <vector>

#include "io/file/content_hash.h"
#include "io/scene/cache.h"

namespace h6::io {
namespace {

// Change these when the baked result of the same input changes: old files are then baked again.
constexpr std::uint32_t field_bake_version = 4, shell_bake_version = 2;

// A key is the hash of a list: every entry with its own length, so that no two lists run together.
class KeyWriter {
 public:
  void text(const std::string& value) { array(value.data(), value.size()); }
  template <class T>
  void value(T v) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    put(&v, sizeof v);
  }
  template <class T>
  void column(const std::vector<T>& values) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_same_v<T, Vec3>);
    array(values.data(), values.size() * sizeof(T));
  }
  std::string key() const { return hex(hash_bytes(list_.data(), list_.size())); }

 private:
  void array(const void* bytes, std::size_t size) {
    const Hash128 hash = hash_bytes(bytes, size);
    value(std::uint64_t(size));
    value(hash.low);
    value(hash.high);
  }
  void put(const void* bytes, std::size_t size) {
    list_.append(static_cast<const char*>(bytes), size);
  }
  std::string list_;
};

void add_mesh(KeyWriter& key, const Mesh& mesh) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  key.column(mesh.vertices);
  key.column(mesh.triangles);
  key.column(mesh.part);
  key.value(std::uint64_t(mesh.part_names.size()));
  for (const std::string& name : mesh.part_names) key.text(name);
}

// `threads` is left out, here and below: it does not change the result.
void add_options(KeyWriter& key, const FieldBake& options) {
  key.value(options.voxels);
  key.value(options.voxel_size);
  key.value(options.offset);
  key.value(options.sign);
  key.value(options.cavities);
  key.value(options.seal);
  key.value(options.band_voxels);
  key.value(options.padding_voxels);
}

}  // namespace

std::string content_hash(const Mesh& mesh, const FieldBake& options) {
  KeyWriter key;
  key.text("field");
  key.value(field_bake_version);
  add_mesh(key, mesh);
  add_options(key, options);
  return key.key();
}

std::string content_hash(const Mesh& mesh, const ShellBake& options) {
  KeyWriter key;
  key.text("shell");
  key.value(shell_bake_version);
  add_mesh(key, mesh);
  key.value(std::uint64_t(options.points));
  key.value(options.spacing);
  key.value(options.levels);
  key.value(options.seed);
  key.value(options.surface);
  key.value(options.normals);
  add_options(key, options.field);
  return key.key();
}

}  // namespace h6::io
