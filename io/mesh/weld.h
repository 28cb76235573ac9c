// SPDX-License-Identifier: Apache-2.0
// weld.h - makes equal points one vertex. There is no tolerance, so no two features of a part
// merge.
//
// A hash table with linear probing holds (hash tag, vertex number), 8 bytes a slot. The loop is
// bound by memory, so it hashes points a few places ahead and prefetches their slots. Vertices are
// numbered in order of first appearance.
#pragma once
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "io/mesh/mesh.h"

namespace h6::io {

struct Welded {
  std::vector<Vec3> vertices;        // (unique points) in order of first appearance
  std::vector<std::uint32_t> index;  // (points) the vertex of each
};

// Turns -0 into +0, so that equal points have equal bits.
inline Vec3 without_minus_zero(const Vec3& p) { return {p.x + 0.0, p.y + 0.0, p.z + 0.0}; }

class WeldTable {
 public:
  explicit WeldTable(std::size_t expected_vertices)
      : slots_(std::bit_ceil(expected_vertices * 2 + 16), kEmpty), mask_(slots_.size() - 1) {}

  static std::uint64_t hash(const Vec3& p) {
    std::uint64_t h = std::bit_cast<std::uint64_t>(p.x) * 0x9e3779b97f4a7c15u;
    h = (h ^ (h >> 32) ^ std::bit_cast<std::uint64_t>(p.y)) * 0xd6e8feb86659fd93u;
    h = (h ^ (h >> 29) ^ std::bit_cast<std::uint64_t>(p.z)) * 0xa0761d6478bd642fu;
    return h ^ (h >> 32);
  }

  void prefetch(std::uint64_t hash) const { __builtin_prefetch(&slots_[hash & mask_]); }

  // The number of p in `vertices`; adds p when it is new.
  std::uint32_t find_or_add(const Vec3& p, std::uint64_t hash, std::vector<Vec3>& vertices) {
    std::size_t at = hash & mask_;
    for (; slots_[at] != kEmpty; at = (at + 1) & mask_) {
      if ((slots_[at] ^ hash) >> 32) continue;
      const Vec3& q = vertices[static_cast<std::uint32_t>(slots_[at])];
      if (q.x == p.x && q.y == p.y && q.z == p.z) return static_cast<std::uint32_t>(slots_[at]);
    }
    const auto number = static_cast<std::uint32_t>(vertices.size());
    vertices.push_back(p);
    slots_[at] = entry(hash, number);
    if (vertices.size() * 2 > slots_.size()) grow(vertices);
    return number;
  }

 private:
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};  // no vertex has the number 2^32 - 1
  static std::uint64_t entry(std::uint64_t hash, std::uint32_t number) {
    return (hash & 0xffffffff00000000u) | number;
  }

  void grow(const std::vector<Vec3>& vertices) {
    slots_.assign(slots_.size() * 2, kEmpty);
    mask_ = slots_.size() - 1;
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      const std::uint64_t h = hash(vertices[v]);
      std::size_t at = h & mask_;
      while (slots_[at] != kEmpty) at = (at + 1) & mask_;
      slots_[at] = entry(h, static_cast<std::uint32_t>(v));
    }
  }

  std::vector<std::uint64_t> slots_;
  std::size_t mask_;
};

// `point(i)` is the i-th of `count` points, without minus zeros; count < 2^32 - 1.
template <class Point>
Welded weld_points(std::size_t count, std::size_t expected_vertices, const Point& point) {
  constexpr std::size_t kAhead = 16;
  Welded out;
  out.vertices.reserve(expected_vertices);
  out.index.resize(count);
  WeldTable table(expected_vertices);
  std::array<std::uint64_t, kAhead> hashes{};
  for (std::size_t i = 0; i < count + kAhead; ++i) {
    if (i >= kAhead) {
      const std::size_t now = i - kAhead;
      out.index[now] = table.find_or_add(point(now), hashes[now % kAhead], out.vertices);
    }
    if (i < count) {
      hashes[i % kAhead] = WeldTable::hash(point(i));
      table.prefetch(hashes[i % kAhead]);
    }
  }
  return out;
}

}  // namespace h6::io
