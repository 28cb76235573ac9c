// SPDX-License-Identifier: Apache-2.0
#include "io/field/vdb_tree.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace h6::io {
namespace {

constexpr char kAllValues = 6;  // how an array of values is stored: each of them, no mask
constexpr int kUpper = 32, kLower = 16;
constexpr std::size_t kUpperSlots = 32 * 32 * 32, kLowerSlots = 16 * 16 * 16;

template <class T>
void append(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::size_t upper_slot(const std::array<std::uint8_t, 3>& b) {
  return (std::size_t(b[0] / kLower) * kUpper + b[1] / kLower) * kUpper + b[2] / kLower;
}
std::size_t lower_slot(const std::array<std::uint8_t, 3>& b) {
  return (std::size_t(b[0] % kLower) * kLower + b[1] % kLower) * kLower + b[2] % kLower;
}

// The value of space without leaves: the side of the far grid there, which is the side of all of
// it. Behind the last brick is outside.
float tile(const FieldData& f, std::size_t x, std::size_t y, std::size_t z) {
  const float band = float(f.band);
  const std::size_t nx = std::size_t(f.bricks[0]), ny = std::size_t(f.bricks[1]),
                    nz = std::size_t(f.bricks[2]);
  if (x >= nx || y >= ny || z >= nz) return band;
  return f.far_grid[(z * (ny + 1) + y) * (nx + 1) + x] < 0 ? -band : band;
}

// An internal node: which slots are children, which tiles are active (none), and the tiles.
class Node {
 public:
  Node(std::size_t slots) : child_(slots / 8, '\0'), tile_(slots, 0.0f) {}
  void child(std::size_t slot) { child_[slot / 8] |= char(1 << slot % 8); }
  bool is_child(std::size_t slot) const { return child_[slot / 8] >> slot % 8 & 1; }
  void tile(std::size_t slot, float value) { tile_[slot] = value; }
  void write(std::string& out) const {
    out += child_;
    out.append(child_.size(), '\0');
    out += kAllValues;
    out.append(reinterpret_cast<const char*>(tile_.data()), tile_.size() * sizeof(float));
  }

 private:
  std::string child_;
  std::vector<float> tile_;
};

std::string root(float background, std::uint32_t children) {
  std::string out;
  append(out, std::int32_t{1});  // one buffer a leaf
  append(out, background);
  append(out, std::uint32_t{0});  // tiles
  append(out, children);
  return out;
}

class Bytes {
 public:
  explicit Bytes(std::span<const char> bytes) : rest_(bytes) {}
  const char* take(std::size_t count) {
    if (count > rest_.size()) return nullptr;
    const char* at = rest_.data();
    rest_ = rest_.subspan(count);
    return at;
  }
  template <class T>
  bool is(T value) {
    const char* at = take(sizeof value);
    return at != nullptr && std::memcmp(at, &value, sizeof value) == 0;
  }
  // The children of an internal node, as a mask.
  const unsigned char* node(std::size_t slots) {
    const char* mask = take(slots / 8);
    const char* rest = take(slots / 8 + 1 + slots * sizeof(float));
    if (mask == nullptr || rest == nullptr || rest[slots / 8] != kAllValues) return nullptr;
    return reinterpret_cast<const unsigned char*>(mask);
  }
  bool ended() const { return rest_.empty(); }

 private:
  std::span<const char> rest_;
};

bool all_active(const char* mask) {
  for (int i = 0; i < 64; ++i)
    if (mask[i] != '\xff') return false;
  return true;
}

std::uint32_t cell_order(const VdbLeaf& leaf) {
  return std::uint32_t(leaf.brick[2]) << 16 | std::uint32_t(leaf.brick[1]) << 8 | leaf.brick[0];
}

// Rows x and z of a block of 8^3 change places.
void swap_x_z(const char* from, char* to) {
  float in[512], out[512];
  std::memcpy(in, from, sizeof in);
  for (std::size_t y = 0; y < 8; ++y)
    for (std::size_t z = 0; z < 8; ++z)
      for (std::size_t x = 0; x < 8; ++x) out[x * 64 + y * 8 + z] = in[z * 64 + y * 8 + x];
  std::memcpy(to, out, sizeof out);
}

}  // namespace

std::vector<VdbLeaf> leaves_of(const FieldData& f) {
  std::vector<VdbLeaf> leaves;
  leaves.reserve(f.brick_count());
  const int nx = f.bricks[0], ny = f.bricks[1], nz = f.bricks[2];
  for (int X = 0; X < nx; X += kLower)
    for (int Y = 0; Y < ny; Y += kLower)
      for (int Z = 0; Z < nz; Z += kLower)
        for (int x = X; x < std::min(nx, X + kLower); ++x)
          for (int y = Y; y < std::min(ny, Y + kLower); ++y)
            for (int z = Z; z < std::min(nz, Z + kLower); ++z) {
              const std::int32_t row =
                  f.brick_index[(std::size_t(z) * std::size_t(ny) + std::size_t(y)) *
                                    std::size_t(nx) +
                                std::size_t(x)];
              if (row >= 0)
                leaves.push_back(
                    {{std::uint8_t(x), std::uint8_t(y), std::uint8_t(z)}, std::uint32_t(row)});
            }
  return leaves;
}

std::string empty_vdb_topology(float background) { return root(background, 0); }

std::string vdb_topology(const FieldData& field, const std::vector<VdbLeaf>& leaves) {
  if (leaves.empty()) return empty_vdb_topology(float(field.band));
  std::string out = root(float(field.band), 1);
  out.reserve(out.size() + leaves.size() * 72 + kUpperSlots * 5);
  append(out, std::array<std::int32_t, 3>{0, 0, 0});
  Node upper(kUpperSlots);
  for (const VdbLeaf& leaf : leaves) upper.child(upper_slot(leaf.brick));
  for (std::size_t s = 0; s < kUpperSlots; ++s)
    if (!upper.is_child(s))
      upper.tile(s, tile(field, s / 1024 * kLower, s / 32 % 32 * kLower, s % 32 * kLower));
  upper.write(out);
  for (std::size_t i = 0, j = 0; i < leaves.size(); i = j) {
    const std::size_t s = upper_slot(leaves[i].brick);
    Node lower(kLowerSlots);
    for (; j < leaves.size() && upper_slot(leaves[j].brick) == s; ++j)
      lower.child(lower_slot(leaves[j].brick));
    for (std::size_t n = 0; n < kLowerSlots; ++n)
      if (!lower.is_child(n))
        lower.tile(n, tile(field, s / 1024 * kLower + n / 256, s / 32 % 32 * kLower + n / 16 % 16,
                           s % 32 * kLower + n % 16));
    lower.write(out);
    out.append(64 * (j - i), '\xff');
  }
  return out;
}

bool read_topology(std::span<const char> bytes, std::vector<VdbLeaf>& leaves) {
  leaves.clear();
  Bytes in(bytes);
  if (!in.is(std::int32_t{1}) || in.take(sizeof(float)) == nullptr || !in.is(std::uint32_t{0}))
    return false;
  if (Bytes none = in; none.is(std::uint32_t{0})) return none.ended();
  if (!in.is(std::uint32_t{1}) || !in.is(std::array<std::int32_t, 3>{0, 0, 0})) return false;
  const unsigned char* upper = in.node(kUpperSlots);
  if (upper == nullptr) return false;
  for (std::size_t s = 0; s < kUpperSlots; ++s) {
    if (!(upper[s / 8] >> s % 8 & 1)) continue;
    const std::size_t corner[3] = {s / 1024 * kLower, s / 32 % 32 * kLower, s % 32 * kLower};
    const unsigned char* lower = in.node(kLowerSlots);
    if (lower == nullptr || std::max({corner[0], corner[1], corner[2]}) > 255) return false;
    for (std::size_t n = 0; n < kLowerSlots; ++n) {
      if (!(lower[n / 8] >> n % 8 & 1)) continue;
      const char* mask = in.take(64);
      if (mask == nullptr || !all_active(mask)) return false;
      leaves.push_back({{std::uint8_t(corner[0] + n / 256), std::uint8_t(corner[1] + n / 16 % 16),
                         std::uint8_t(corner[2] + n % 16)},
                        0});
    }
  }
  if (!in.ended() || leaves.size() > std::numeric_limits<std::int32_t>::max()) return false;
  std::vector<std::uint64_t> order(leaves.size());
  for (std::size_t i = 0; i < leaves.size(); ++i)
    order[i] = std::uint64_t(cell_order(leaves[i])) << 32 | i;
  std::sort(order.begin(), order.end());
  for (std::size_t r = 0; r < order.size(); ++r)
    leaves[order[r] & 0xffffffffu].row = std::uint32_t(r);
  return true;
}

void write_leaf(const float* samples, char* record) {
  std::memset(record, 0xff, 64);
  record[64] = kAllValues;
  swap_x_z(reinterpret_cast<const char*>(samples), record + 65);
}

bool read_leaf(const char* record, float* samples) {
  if (!all_active(record) || record[64] != kAllValues) return false;
  swap_x_z(record + 65, reinterpret_cast<char*>(samples));
  std::uint32_t infinite = 0;
  for (std::size_t i = 0; i < 512; ++i) {
    std::uint32_t bits;
    std::memcpy(&bits, samples + i, sizeof bits);
    infinite |= std::uint32_t((bits & 0x7f800000u) == 0x7f800000u);
  }
  return infinite == 0;
}

}  // namespace h6::io
