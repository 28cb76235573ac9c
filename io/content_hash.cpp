// content_hash.cpp - the fingerprint, and the keys of cached assets made with it (cache.h).
#include "io/content_hash.h"

#include <bit>
#include <cstring>
#include <type_traits>
#include <vector>

#include "io/cache.h"

namespace h6::io {
namespace {

constexpr std::uint64_t c1 = 0x87C37B91114253D5u, c2 = 0x4CF5AD432745937Fu;

std::uint64_t stir_low(std::uint64_t word) { return std::rotl(word * c1, 31) * c2; }
std::uint64_t stir_high(std::uint64_t word) { return std::rotl(word * c2, 33) * c1; }

std::uint64_t avalanche(std::uint64_t h) {
  h = (h ^ (h >> 33)) * 0xFF51AFD7ED558CCDu;
  h = (h ^ (h >> 33)) * 0xC4CEB9FE1A85EC53u;
  return h ^ (h >> 33);
}

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

Hash128 hash_bytes(const void* bytes, std::size_t size) {
  static_assert(std::endian::native == std::endian::little);
  const char* at = static_cast<const char*>(bytes);
  Hash128 h;
  std::size_t left = size;
  for (; left >= 16; left -= 16, at += 16) {
    std::uint64_t word[2];
    std::memcpy(word, at, 16);
    h.low = (std::rotl(h.low ^ stir_low(word[0]), 27) + h.high) * 5 + 0x52DCE729u;
    h.high = (std::rotl(h.high ^ stir_high(word[1]), 31) + h.low) * 5 + 0x38495AB5u;
  }
  std::uint64_t tail[2] = {0, 0};
  if (left > 0) std::memcpy(tail, at, left);
  h.low ^= stir_low(tail[0]) ^ size;
  h.high ^= stir_high(tail[1]) ^ size;
  h.low += h.high;
  h.high += h.low;
  h.low = avalanche(h.low);
  h.high = avalanche(h.high);
  h.low += h.high;
  h.high += h.low;
  return h;
}

std::string hex(const Hash128& hash) {
  std::string text;
  for (const std::uint64_t half : {hash.low, hash.high}) {
    for (int shift = 60; shift >= 0; shift -= 4) text += "0123456789abcdef"[(half >> shift) & 15];
  }
  return text;
}

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
