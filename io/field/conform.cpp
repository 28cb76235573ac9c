// SPDX-License-Identifier: Apache-2.0
// conform.cpp - a cell can work out what the cells around it have at shared nodes. An uncut cell
// interpolates its corners there, and the shared ones are the cell's own, too. A cell with halves
// interpolates nodes that are every second one of the cell's own. So the cell only has to know how
// finely the others are sampled.
#include "io/field/conform.h"

#include <array>
#include <vector>

#include "io/field/box.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

// Bit i: the node touches cell i of the 3 x 3 x 3 around; for all nodes of a cell cut into
// `factor`.
template <int factor>
constexpr std::array<std::uint32_t, (factor + 1) * (factor + 1) * (factor + 1)> touched() {
  constexpr int side = factor + 1;
  std::array<std::uint32_t, side * side * side> bits{};
  for (int n = 0; n < side * side * side; ++n)
    for (int i = 0; i < 27; ++i) {
      const int at[3] = {n % side, n / side % side, n / side / side};
      const int cell[3] = {i % 3, i / 3 % 3, i / 9};
      bool touches = true;
      for (int k = 0; k < 3; ++k)
        touches = touches && (cell[k] == 1 || at[k] == (cell[k] == 0 ? 0 : factor));
      bits[std::size_t(n)] |= std::uint32_t(touches) << i;
    }
  return bits;
}
constexpr auto kOfHalves = touched<2>();
constexpr auto kOfQuarters = touched<4>();

// Samples a voxel in the cells of a brick and in one layer around it; 0 where a cell has none.
class Sampled {
 public:
  Sampled(const FieldData& field, const GridNode& brick) {
    for (int i = 0; i < 27; ++i)
      row_[i] =
          row_of(field, {brick[0] + i % 3 - 1, brick[1] + i / 3 % 3 - 1, brick[2] + i / 9 - 1});
    for (int z = -1; z <= 8; ++z)
      for (int y = -1; y <= 8; ++y)
        for (int x = -1; x <= 8; ++x) factor_[place(x, y, z)] = look_up(field, x, y, z);
  }

  // Bit i: cell i of the 3 x 3 x 3 around a cell of the brick has `factor`.
  std::uint32_t around(int x, int y, int z, int factor) const {
    std::uint32_t bits = 0;
    int i = 0;
    for (int c = z - 1; c <= z + 1; ++c)
      for (int b = y - 1; b <= y + 1; ++b)
        for (int a = x - 1; a <= x + 1; ++a)
          bits |= std::uint32_t(factor_[place(a, b, c)] == factor) << i++;
    return bits;
  }

 private:
  static std::size_t place(int x, int y, int z) {
    return std::size_t(100 * (z + 1) + 10 * (y + 1) + x + 1);
  }
  std::int32_t row(int x, int y, int z) const {
    return row_[9 * (1 + (z >> 3)) + 3 * (1 + (y >> 3)) + 1 + (x >> 3)];
  }
  std::uint8_t look_up(const FieldData& field, int x, int y, int z) const {
    const std::int32_t own = row(x, y, z);
    if (own < 0) return 0;
    const std::int32_t refined = field.refined[std::size_t(own)];
    const std::size_t local = std::size_t(64 * (z & 7) + 8 * (y & 7) + (x & 7));
    const std::int32_t i = refined < 0 ? 0 : field.fine_index[512 * std::size_t(refined) + local];
    if (i != 0) return i < 0 ? 4 : 2;
    bool whole = true;  // at the band's end a corner may be missing
    const bool at_face = (x & 7) == 7 || (y & 7) == 7 || (z & 7) == 7;
    for (int c = 1; c < 8 && at_face; ++c)
      whole = whole && row(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)) >= 0;
    return whole ? 1 : 0;
  }

  std::int32_t row_[27];
  std::uint8_t factor_[1000];
};

// Nodes that touch one of `cells`, and none of `others`, take the values of `from`.
template <std::size_t count>
void take(const std::array<std::uint32_t, count>& touches, std::uint32_t cells,
          std::uint32_t others, const float (&from)[count], float* values) {
  for (std::size_t n = 0; n < count; ++n) {
    const bool taken = ((touches[n] & cells) != 0) & ((touches[n] & others) == 0);
    values[n] = taken ? from[n] : values[n];
  }
}

void conform_halves(const float (&corners)[8], std::uint32_t ones, float* values) {
  float flat[27];
  interpolate<2, 2>(corners, flat);
  take(kOfHalves, ones, 0, flat, values);
}

void conform_quarters(const float (&corners)[8], std::uint32_t ones, std::uint32_t twos,
                      float* values) {
  float flat[125], half[27];
  interpolate<2, 4>(corners, flat);
  take(kOfQuarters, ones, 0, flat, values);
  if (twos == 0) return;
  for (int n = 0; n < 27; ++n) half[n] = values[50 * (n / 9) + 10 * (n / 3 % 3) + 2 * (n % 3)];
  interpolate<3, 2>(half, flat);
  take(kOfQuarters, twos, ones, flat, values);
}

// All cut cells of one refined brick.
void conform_brick(const GridNode& brick, const std::int32_t* index, FieldData& field) {
  const Sampled sampled(field, brick);
  float box[kBox];
  read_box(field, brick, box);
  for (int c = 0; c < 512; ++c) {
    if (index[c] == 0) continue;
    const int x = c % 8, y = c / 8 % 8, z = c / 64;
    const std::uint32_t ones = sampled.around(x, y, z, 1);
    const std::uint32_t twos = index[c] > 0 ? 0 : sampled.around(x, y, z, 2);
    if ((ones | twos) == 0) continue;
    float corners[8];
    for (int k = 0; k < 8; ++k)
      corners[k] = box[81 * (z + (k >> 2)) + 9 * (y + (k >> 1 & 1)) + x + (k & 1)];
    if (index[c] > 0)
      conform_halves(corners, ones, &field.halves[27 * std::size_t(index[c] - 1)]);
    else
      conform_quarters(corners, ones, twos, &field.quarters[125 * std::size_t(-1 - index[c])]);
  }
}

}  // namespace

void conform(unsigned threads, FieldData& field) {
  if (field.refined.empty()) return;
  std::vector<std::size_t> bricks;
  for (std::size_t c = 0; c < field.brick_index.size(); ++c)
    if (field.brick_index[c] >= 0 && field.refined[std::size_t(field.brick_index[c])] >= 0)
      bricks.push_back(c);
  sched::parallel_for(bricks.size(), threads, [&](std::size_t b) {
    const std::size_t row = std::size_t(field.brick_index[bricks[b]]);
    conform_brick(place_of(bricks[b], field.bricks),
                  &field.fine_index[512 * std::size_t(field.refined[row])], field);
  });
}

}  // namespace h6::io
