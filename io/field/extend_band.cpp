// SPDX-License-Identifier: Apache-2.0
// extend_band.cpp - see extend_band.h. Lengths are voxels, unless [m] stands there.
#include "io/field/extend_band.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "io/field/grids.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr double kLongestWay = 4.5;  // |n - m|
constexpr int kAround = 4;           // nodes of it along an axis
constexpr float kDepthOfK = 2.5f;
constexpr float kBeyond = 2.0f;
constexpr float kDetour = 0.25f;
constexpr float kCellDiagonal = 1.7321f;
constexpr int kSide = 8 + 2 * kAround;
constexpr float kNoNode = std::numeric_limits<float>::infinity();

// The ways from a node to those of all rows along x that are as far from its own row: their lengths
// at x - dx and x + dx.
struct RingOfWays {
  int most_dx = -1;
  float length[kAround + 1] = {};
  std::vector<int> rows;  // kSide dz + dy
};

// The shortest first: they soon give sums that no longer ones can beat.
std::vector<RingOfWays> ways_around() {
  std::map<int, RingOfWays> rings;  // by dy^2 + dz^2
  for (int dz = -kAround; dz <= kAround; ++dz)
    for (int dy = -kAround; dy <= kAround; ++dy) {
      const int aside = dy * dy + dz * dz;
      if (aside > kLongestWay * kLongestWay) continue;
      RingOfWays& ring = rings[aside];
      ring.rows.push_back(kSide * dz + dy);
      for (int dx = 0; dx <= kAround; ++dx) {
        const double length = std::sqrt(double(dx * dx + aside));
        if (length <= kLongestWay) ring.most_dx = dx, ring.length[dx] = float(length);
      }
    }
  std::vector<RingOfWays> out;
  for (auto& [aside, ring] : rings) out.push_back(std::move(ring));
  return out;
}

// |d| of the nodes of K in and around a brick, infinity at all others.
struct Surroundings {
  float d[kSide * kSide * kSide];
  float least[kSide * kSide];  // of each row along x
  float least_of_all;
};

// Sums over the nodes x - dx and x + dx of a row, dx < count, for eight nodes x. The loop over x
// becomes vectors only if it is not unrolled before, and if `v` overlaps nothing.
void lower_row(const float* d, const float* length, int count, float* __restrict v) {
  for (int dx = 0; dx < count; ++dx) {
    const float way = length[dx];
#pragma GCC unroll 1
    for (int x = 0; x < 8; ++x) v[x] = std::min(v[x], std::min(d[x - dx], d[x + dx]) + way);
  }
}

class Extension {
 public:
  Extension(const FieldData& field, double known)
      : field_(field),
        cells_{field.bricks},
        known_(float(known)),
        voxel_(float(field.voxel_size)),
        band_(known_ / voxel_),
        ways_(ways_around()) {}

  // v of the nodes beyond the band.
  void measure(std::size_t cell, float (&v)[512]) const {
    Surroundings around;
    gather(cell, around);
    const float* own = brick(cells_.at(cell));
    for (int n = 0; n < 512; ++n) v[n] = own != nullptr && in_band(own[n]) ? 0 : band_ + kBeyond;
    for (int row = 0; row < 64; ++row) measure_row(around, row % 8, row / 8, v + 8 * row);
    for (float& each : v) each = std::max(each - kDetour, band_);
  }
  // Whether any node of an empty cell has a v of less than b + sqrt(3). The node that is nearest to
  // a node of K beside the cell has the least sum with it.
  bool is_near(std::size_t cell) const {
    Surroundings around;
    gather(cell, around);
    const auto beside = [](int at) { return std::max({kAround - at, at - kAround - 7, 0}); };
    float least = kNoNode;
    for (int z = 0; z < kSide; ++z)
      for (int y = 0; y < kSide; ++y) {
        if (around.least[z * kSide + y] == kNoNode) continue;
        for (int x = 0; x < kSide; ++x) {
          const int dx = beside(x), dy = beside(y), dz = beside(z);
          const float way = std::sqrt(float(dx * dx + dy * dy + dz * dz));
          least = std::min(least, around.d[(z * kSide + y) * kSide + x] + way);
        }
      }
    return least - kDetour < band_ + kCellDiagonal;
  }
  // The samples of a brick whose nodes beyond the band have v [m].
  void write(std::size_t cell, const float (&v)[512], bool inside, float* out) const {
    const float* own = brick(cells_.at(cell));
    for (int n = 0; n < 512; ++n) {
      const float side = own != nullptr ? own[n] : inside ? -1.0f : 1.0f;
      out[n] = own != nullptr && in_band(own[n]) ? own[n] : std::copysign(v[n] * voxel_, side);
    }
  }

 private:
  bool in_band(float sample) const { return std::fabs(sample) < known_; }

  void measure_row(const Surroundings& around, int y, int z, float* v) const {
    const int own = (z + kAround) * kSide + y + kAround;
    for (const RingOfWays& ring : ways_) {
      const float worst = *std::max_element(v, v + 8);
      if (worst <= ring.length[0] + around.least_of_all) return;
      for (const int row : ring.rows) {
        const float least = around.least[own + row];
        int count = 0;
        while (count <= ring.most_dx && least + ring.length[count] < worst) ++count;
        if (count > 0) lower_row(around.d + (own + row) * kSide + kAround, ring.length, count, v);
      }
    }
  }

  void gather(std::size_t cell, Surroundings& around) const {
    std::fill_n(around.d, kSide * kSide * kSide, kNoNode);
    std::fill_n(around.least, kSide * kSide, kNoNode);
    const auto at = cells_.at(cell);
    for (int k = 0; k < 27; ++k) {
      const std::array<int, 3> step{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
      const float* samples = brick({at[0] + step[0], at[1] + step[1], at[2] + step[2]});
      if (samples != nullptr) gather_brick(samples, step, around);
    }
    around.least_of_all = *std::min_element(around.least, around.least + kSide * kSide);
  }

  // The nodes of the brick that stands `step` bricks away.
  void gather_brick(const float* samples, const std::array<int, 3>& step,
                    Surroundings& around) const {
    std::array<int, 3> low, high;  // of its nodes
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = step[a] < 0 ? 8 - kAround : 0;
      high[a] = step[a] > 0 ? kAround : 8;
    }
    for (int z = low[2]; z < high[2]; ++z)
      for (int y = low[1]; y < high[1]; ++y) {
        const int row = (z + kAround + 8 * step[2]) * kSide + y + kAround + 8 * step[1];
        for (int x = low[0]; x < high[0]; ++x) {
          const float sample = samples[(z * 8 + y) * 8 + x], d = std::fabs(sample) / voxel_;
          if (!in_band(sample) || d < band_ - kDepthOfK) continue;
          around.d[row * kSide + x + kAround + 8 * step[0]] = d;
          around.least[row] = std::min(around.least[row], d);
        }
      }
  }

  // The samples of a brick [m], null where there are none.
  const float* brick(const std::array<std::int32_t, 3>& at) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (at[k] < 0 || at[k] >= field_.bricks[k]) return nullptr;
    const std::int32_t row = field_.brick_index[cells_.index(at[0], at[1], at[2])];
    return row < 0 ? nullptr : &field_.samples[std::size_t(row) * 512];
  }

  const FieldData& field_;
  const Place cells_;
  const float known_, voxel_;  // [m]
  const float band_;
  const std::vector<RingOfWays> ways_;
};

// The cells without a brick next to bricks.
std::vector<std::size_t> cells_beside_bricks(const FieldData& field) {
  const Place cells{field.bricks};
  std::vector<char> beside(cells.count());
  for (std::size_t c = 0; c < cells.count(); ++c) {
    if (field.brick_index[c] < 0) continue;
    const auto at = cells.at(c);
    std::array<std::int32_t, 3> low, high;
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::max(at[a] - 1, 0);
      high[a] = std::min(at[a] + 1, field.bricks[a] - 1);
    }
    for (std::int32_t z = low[2]; z <= high[2]; ++z)
      for (std::int32_t y = low[1]; y <= high[1]; ++y)
        for (std::int32_t x = low[0]; x <= high[0]; ++x) beside[cells.index(x, y, z)] = 1;
  }
  std::vector<std::size_t> out;
  for (std::size_t c = 0; c < cells.count(); ++c)
    if (beside[c] != 0 && field.brick_index[c] < 0) out.push_back(c);
  return out;
}

}  // namespace

void extend_band(FieldData& field, double known,
                 const std::function<bool(std::size_t cell)>& inside, unsigned threads) {
  const Extension extension(field, known);
  const std::vector<std::size_t> candidates = cells_beside_bricks(field);
  std::vector<char> added(field.brick_index.size());
  sched::parallel_for(candidates.size(), threads, [&](std::size_t i) {
    added[candidates[i]] = extension.is_near(candidates[i]);
  });

  Large<std::int32_t> index(field.brick_index.size(), -1);
  std::vector<std::size_t> cells;
  for (std::size_t c = 0; c < index.size(); ++c) {
    if (field.brick_index[c] < 0 && added[c] == 0) continue;
    index[c] = std::int32_t(cells.size());
    cells.push_back(c);
  }
  Samples samples(cells.size() * 512);
  sched::parallel_for(cells.size(), threads, [&](std::size_t i) {
    float v[512];
    extension.measure(cells[i], v);
    extension.write(cells[i], v, inside(cells[i]), &samples[i * 512]);
  });
  field.brick_index = std::move(index);
  field.samples = std::move(samples);
}

}  // namespace h6::io
