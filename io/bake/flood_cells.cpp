// SPDX-License-Identifier: Apache-2.0
// flood_cells.cpp - which open cells of a flood (flood.h) are connected with the border.
#include <algorithm>

#include "io/bake/flood.h"

namespace h6::io::bake::flooding {
namespace {

// The bits of `open` that are connected with those of `wet` along the word.
std::uint64_t along(std::uint64_t wet, std::uint64_t open) {
  std::uint64_t up = open, down = open;
  for (int by = 1; by < 64; by *= 2) {
    wet |= (wet << by & up) | (wet >> by & down);
    up &= up << by;
    down &= down >> by;
  }
  return wet;
}

}  // namespace

// All open cells connected with one on the border; a line of cells along x is a few words.
std::vector<std::uint64_t> Flood::open_from_border() const {
  const std::size_t nx = std::size_t(grid_.bricks[0]), ny = std::size_t(grid_.bricks[1]),
                    nz = std::size_t(grid_.bricks[2]), lines = ny * nz, layer = ny * words_;
  std::vector<std::uint64_t> open(lines * words_, 0), wet(lines * words_, 0);
  for (std::size_t line = 0; line < lines; ++line) {
    std::uint64_t* to = &open[line * words_];
    for (std::size_t a = 0; a < nx; ++a)
      to[a / 64] |= std::uint64_t((state_[line * nx + a] & kOpen) != 0) << (a % 64);
    const std::size_t b = line % ny, c = line / ny;
    if (b == 0 || b + 1 == ny || c == 0 || c + 1 == nz)
      std::copy_n(to, words_, &wet[line * words_]);
    wet[line * words_] |= to[0] & 1;
    wet[line * words_ + (nx - 1) / 64] |= to[(nx - 1) / 64] & std::uint64_t{1} << ((nx - 1) % 64);
  }
  bool changed;
  const auto visit = [&](std::size_t line) {
    const std::size_t b = line % ny, c = line / ny, first = line * words_;
    for (std::size_t k = 0; k < 2 * words_; ++k) {  // there and back
      const std::size_t in = k < words_ ? k : 2 * words_ - 1 - k, i = first + in;
      std::uint64_t w = wet[i];
      if (w == open[i]) continue;
      if (b > 0) w |= wet[i - words_];
      if (b + 1 < ny) w |= wet[i + words_];
      if (c > 0) w |= wet[i - layer];
      if (c + 1 < nz) w |= wet[i + layer];
      if (in > 0) w |= wet[i - 1] >> 63;
      if (in + 1 < words_) w |= wet[i + 1] << 63;
      w = along(w & open[i], open[i]);
      changed |= w != wet[i];
      wet[i] = w;
    }
  };
  do {
    changed = false;
    for (std::size_t line = 0; line < lines; ++line) visit(line);
    for (std::size_t line = lines; line-- > 0;) visit(line);
  } while (changed);
  return wet;
}

}  // namespace h6::io::bake::flooding
