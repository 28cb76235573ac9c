// bake_leaves.cpp - the order of triangles in the tree (see bake_leaves.h).
//
// Triangles in the order of Hilbert's curve lie together, but eights of them that follow each other
// on it lie anyhow: around edges, across faces. So every 512 of them are halved until eights are
// left, each time along the axis that leaves the smallest boxes: a search of the tree then weighs
// two thirds of the leaves.
#include "io/bake_leaves.h"

#include <algorithm>
#include <utility>

#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

// Steps of eight, of which compilers make vectors.
using Eight = std::array<std::uint32_t, 8>;

// Ten bits each, interleaved.
std::uint32_t apart(std::uint32_t v) {
  v &= 0x3ff;
  v = (v | v << 16) & 0x030000ff;
  v = (v | v << 8) & 0x0300f00f;
  v = (v | v << 4) & 0x030c30c3;
  return (v | v << 2) & 0x09249249;
}

// The places of eight cells on Hilbert's curve, which leaves no cube before it has been everywhere
// in it and never jumps: what follows each other lies together (J. Skilling, "Programming the
// Hilbert curve", 2004: reflect and exchange axes from the largest cube down, then undo the Gray
// code).
Eight hilbert(std::array<Eight, 3> c) {
  for (std::uint32_t half = 512; half > 1; half /= 2)
    for (Eight& axis : c)
      for (std::size_t i = 0; i < 8; ++i) {
        const std::uint32_t low = half - 1, upper = (axis[i] & half) != 0 ? ~0u : 0u;
        const std::uint32_t exchange = (c[0][i] ^ axis[i]) & low & ~upper;
        c[0][i] ^= exchange | (low & upper);
        axis[i] ^= exchange;
      }
  Eight place;
  for (std::size_t i = 0; i < 8; ++i) {
    const std::uint32_t x = c[0][i], y = c[1][i] ^ x, z = c[2][i] ^ y;
    std::uint32_t flip = 0;
    for (std::uint32_t half = 512; half > 1; half /= 2) flip ^= (z & half) != 0 ? half - 1 : 0u;
    place[i] = apart(z ^ flip) | apart(y ^ flip) << 1 | apart(x ^ flip) << 2;
  }
  return place;
}

// By the upper half of the words, which has 30 bits; equal ones keep their order. Slices count and
// move side by side; each knows its places from the counts of all.
void sort_by_code(Large<std::uint64_t>& words, unsigned threads) {
  constexpr std::size_t kSlice = 65536, kDigits = 1024;
  Large<std::uint64_t> other(words.size());
  const std::size_t slices = (words.size() + kSlice - 1) / kSlice;
  std::vector<std::array<std::uint32_t, kDigits>> place(slices);
  for (int shift = 32; shift < 62; shift += 10) {
    const auto each = [&](auto&& body) {
      sched::parallel_for(slices, threads, [&](std::size_t s) {
        for (std::size_t i = s * kSlice; i < std::min(words.size(), (s + 1) * kSlice); ++i)
          body(place[s][words[i] >> shift & (kDigits - 1)], words[i]);
      });
    };
    for (auto& counts : place) counts.fill(0);
    each([](std::uint32_t& count, std::uint64_t) { ++count; });
    std::uint32_t sum = 0;
    for (std::size_t digit = 0; digit < kDigits; ++digit)
      for (auto& counts : place) sum += std::exchange(counts[digit], sum);
    each([&](std::uint32_t& to, std::uint64_t word) { other[to++] = word; });
    words.swap(other);
  }
}

// Halves up to so many triangles until eights are left.
class Halves {
 public:
  static constexpr std::size_t kMost = 512;

  void order(const Surface& surface, std::uint32_t* triangles, std::size_t count) {
    double low[3] = {1e30, 1e30, 1e30}, high[3] = {-1e30, -1e30, -1e30};
    for (std::size_t i = 0; i < count; ++i) {
      const auto& t = surface.triangles[triangles[i]];
      const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
                 &c = surface.vertices[t[2]];
      const double corner[3][3] = {{a.x, b.x, c.x}, {a.y, b.y, c.y}, {a.z, b.z, c.z}};
      for (std::size_t k = 0; k < 3; ++k) {
        const double* v = corner[k];
        const double sum = v[0] + v[1] + v[2];
        low[k] = std::min(low[k], sum);
        high[k] = std::max(high[k], sum);
        middle_[k][i] = sum;
        reach_[i].least[k] = float(std::min({v[0], v[1], v[2]}));
        reach_[i].least[4 + k] = -float(std::max({v[0], v[1], v[2]}));
      }
      reach_[i].least[3] = reach_[i].least[7] = 0;
    }
    for (std::size_t k = 0; k < 3; ++k) sort(k, low[k], high[k], count);
    halve(0, count);
    std::uint32_t from[kMost];
    std::copy_n(triangles, count, from);
    for (std::size_t i = 0; i < count; ++i) triangles[i] = from[sorted_[0][i]];
  }

 private:
  using Index = std::uint16_t;
  // Along three axes from where, and minus to where: both are minima.
  struct alignas(32) Reach {
    float least[8];
  };

  // Along an axis; in steps of a 1024th of all, whose order is left as it is.
  void sort(std::size_t k, double low, double high, std::size_t count) {
    constexpr std::size_t kDigits = 1024;
    Index digit[kMost], place[kDigits] = {};
    const double scale = high > low ? (double(kDigits) - 1) / (high - low) : 0;
    for (std::size_t i = 0; i < count; ++i) digit[i] = Index(int((middle_[k][i] - low) * scale));
    for (std::size_t i = 0; i < count; ++i) ++place[digit[i]];
    Index sum = 0;
    for (Index& p : place) sum = Index(sum + std::exchange(p, sum));
    for (std::size_t i = 0; i < count; ++i) sorted_[k][place[digit[i]]++] = Index(i);
  }

  // The squared size of the box around some.
  float size2(const Index* some, std::size_t count) const {
    Reach all = reach_[some[0]];
    for (std::size_t i = 1; i < count; ++i) {
      const Reach& one = reach_[some[i]];
      for (std::size_t k = 0; k < 8; ++k)
        all.least[k] = one.least[k] < all.least[k] ? one.least[k] : all.least[k];
    }
    float sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const float width = all.least[k] + all.least[4 + k];
      sum += width * width;
    }
    return sum;
  }

  void halve(std::size_t first, std::size_t count) {
    if (count <= 8) return;
    const std::size_t half = std::bit_ceil(count) / 2, rest = count - half;
    std::size_t axis = 0;
    float least = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Index* some = sorted_[k] + first;
      const float size = size2(some, half) + size2(some + half, rest);
      if (k == 0 || size < least) {
        least = size;
        axis = k;
      }
    }
    if (count <= 16) {
      if (axis != 0) std::copy_n(sorted_[axis] + first, count, sorted_[0] + first);
      return;
    }
    for (std::size_t i = 0; i < count; ++i) upper_[sorted_[axis][first + i]] = i >= half;
    for (std::size_t k = 0; k < 3; ++k) {
      if (k == axis) continue;
      Index over[kMost];
      Index* some = sorted_[k] + first;
      std::size_t below = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const Index one = some[i];
        over[i - below] = one;
        some[below] = one;
        below += 1u - upper_[one];
      }
      std::copy_n(over, rest, some + half);
    }
    halve(first, half);
    halve(first + half, rest);
  }

  Reach reach_[kMost];
  double middle_[3][kMost];
  Index sorted_[3][kMost];
  std::uint8_t upper_[kMost];
};

}  // namespace

Large<std::uint32_t> order_for_leaves(const Surface& surface, unsigned threads) {
  const std::size_t count = surface.triangles.size();
  constexpr std::size_t kSlice = 8192;
  Large<std::uint64_t> words(count);
  sched::parallel_for((count + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    const std::size_t end = std::min(count, (s + 1) * kSlice);
    for (std::size_t first = s * kSlice; first < end; first += 8) {
      const std::size_t some = std::min<std::size_t>(8, end - first);
      std::array<Eight, 3> cells{};
      for (std::size_t i = 0; i < some; ++i) {
        const auto& t = surface.triangles[first + i];
        const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
                   &c = surface.vertices[t[2]];
        const auto cell = [](double sum) {  // 2 voxels; the grid has at most 2048
          return std::uint32_t(int(std::clamp(sum / 6, 0.0, 1023.0)));
        };
        cells[0][i] = cell(a.x + b.x + c.x);
        cells[1][i] = cell(a.y + b.y + c.y);
        cells[2][i] = cell(a.z + b.z + c.z);
      }
      const Eight places = hilbert(cells);
      for (std::size_t i = 0; i < some; ++i)
        words[first + i] = std::uint64_t{places[i]} << 32 | (first + i);
    }
  });
  sort_by_code(words, threads);
  Large<std::uint32_t> order(count);
  sched::parallel_for((count + Halves::kMost - 1) / Halves::kMost, threads, [&](std::size_t s) {
    const std::size_t first = s * Halves::kMost, some = std::min(Halves::kMost, count - first);
    for (std::size_t i = first; i < first + some; ++i) order[i] = std::uint32_t(words[i]);
    Halves().order(surface, order.data() + first, some);
  });
  return order;
}

}  // namespace h6::io::bake
