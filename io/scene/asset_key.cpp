// SPDX-License-Identifier: Apache-2.0
#include "io/scene/asset_key.h"

#include <cstdint>
#include <type_traits>
#include <vector>

namespace h6::io {
namespace {

// Raise a number when its baker gives another result for the same input, so that old cache files
// are no longer used.
constexpr std::uint32_t field_bake_version = 14, shell_bake_version = 4;

// Hashes a list of values. Each text and each column enters as its length and hash, so that
// different lists do not give the same bytes.
class ListHash {
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
  Hash128 hash() const { return hash_bytes(list_.data(), list_.size()); }

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

Hash128 hash_mesh(const Mesh& mesh) {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  ListHash list;
  list.column(mesh.vertices);
  list.column(mesh.triangles);
  list.column(mesh.part);
  list.value(std::uint64_t(mesh.part_names.size()));
  for (const std::string& name : mesh.part_names) list.text(name);
  return list.hash();
}

void add_mesh(ListHash& list, const HashedMesh& mesh) {
  list.value(mesh.hash.low);
  list.value(mesh.hash.high);
}

// `threads` is left out, here and below, because it does not change the result.
void add_options(ListHash& list, const FieldBake& options) {
  list.value(options.voxels);
  list.value(options.voxel_size);
  list.value(options.offset);
  list.value(options.sign);
  list.value(options.cavities);
  list.value(options.seal);
  list.value(options.weld);
  list.value(options.band_voxels);
  list.value(options.padding_voxels);
  if (options.tolerance > 0) list.value(options.tolerance);
  if (options.weld_length > 0) list.value(options.weld_length);
  if (!options.grow_thin) list.value(options.grow_thin);
  if (norm(options.shift) == 0) return;  // so that keys are those of before there was a shift
  for (const double s : {options.shift.x, options.shift.y, options.shift.z}) list.value(s);
}

}  // namespace

HashedMesh::HashedMesh(const Mesh& of) : mesh(of), hash(hash_mesh(of)) {}

std::string asset_key(const HashedMesh& mesh, const FieldBake& options) {
  ListHash list;
  list.text("field");
  list.value(field_bake_version);
  add_mesh(list, mesh);
  add_options(list, options);
  return hex(list.hash());
}

std::string asset_key(const HashedMesh& mesh, const ShellBake& options) {
  ListHash list;
  list.text("shell");
  list.value(shell_bake_version);
  add_mesh(list, mesh);
  list.value(std::uint64_t(options.points));
  list.value(options.spacing);
  if (options.tolerance > 0) list.value(options.tolerance);
  list.value(options.levels);
  list.value(options.seed);
  list.value(options.surface);
  list.value(options.normals);
  add_options(list, options.field);
  return hex(list.hash());
}

}  // namespace h6::io
