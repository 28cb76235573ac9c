// SPDX-License-Identifier: Apache-2.0
#include "io/scene/asset_hash.h"

#include "io/file/content_hash.h"

namespace h6::io {
namespace {

// Hashes a list of columns. Each column enters as its size and hash, so that moving a value to the
// next column changes the result.
class Columns {
 public:
  template <class Column>
  Columns& add(const Column& values) {
    return add(values.data(), values.size() * sizeof *values.data());
  }
  Columns& add(const void* bytes, std::size_t size) {
    const Hash128 hash = hash_bytes(bytes, size);
    list_.insert(list_.end(), {std::uint64_t{size}, hash.low, hash.high});
    return *this;
  }
  std::string text() const { return hex(hash_bytes(list_.data(), list_.size() * 8)); }

 private:
  std::vector<std::uint64_t> list_;
};

}  // namespace

std::string asset_hash(const FieldData& f) {
  const double numbers[] = {f.origin.x, f.origin.y, f.origin.z, f.voxel_size, f.band};
  return Columns()
      .add(numbers, sizeof numbers)
      .add(f.bricks)
      .add(f.brick_index)
      .add(f.samples)
      .add(f.far_grid)
      .add(f.part)
      .text();
}

std::string asset_hash(const ShellData& s) {
  Columns columns;
  for (const std::vector<float>* column : {&s.x, &s.y, &s.z, &s.nx, &s.ny, &s.nz, &s.node_radius})
    columns.add(*column);
  for (const std::vector<std::uint32_t>* column :
       {&s.source, &s.level_first, &s.node_point, &s.node_first_child, &s.node_child_count})
    columns.add(*column);
  return columns.text();
}

std::string asset_hash(const std::string& shell, const ReducedModel& m) {
  const double numbers[] = {m.mass_damping, m.stiffness_damping};
  Columns columns;
  columns.add(shell)
      .add(numbers, sizeof numbers)
      .add(m.mesh.vertices)
      .add(m.basis)
      .add(m.linear)
      .add(m.quadratic)
      .add(m.cubic);
  if (!m.turn.empty()) columns.add(m.turn);  // other models keep the hash of older recordings
  return columns.text();
}

}  // namespace h6::io
