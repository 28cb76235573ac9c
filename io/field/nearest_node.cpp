// SPDX-License-Identifier: Apache-2.0
// nearest_node.cpp - see nearest_node.h. Nodes x, y, z; nodes of the far grid a, b, c, at 8 a, ...
#include "io/field/nearest_node.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr float kNone = std::numeric_limits<float>::infinity();

// The near nodes' x, ascending, for each line along x.
struct Lines {
  std::vector<std::uint32_t> first;  // (lines + 1)
  std::vector<std::uint16_t> x;
};

// Calls f(line, x) for each near node; along a line x rises.
template <class F>
void each_near(const FieldData& field, float near, F&& f) {
  const std::size_t nx = std::size_t(field.bricks[0]), ny = std::size_t(field.bricks[1]);
  for (std::size_t c = 0; c < field.brick_index.size(); ++c) {
    if (field.brick_index[c] < 0) continue;
    const float* s = &field.samples[512 * std::size_t(field.brick_index[c])];
    const std::size_t x = 8 * (c % nx), y = 8 * (c / nx % ny), z = 8 * (c / nx / ny);
    for (std::size_t n = 0; n < 512; ++n)
      if (std::fabs(s[n]) <= near) f((z + n / 64) * 8 * ny + y + n / 8 % 8, x + n % 8);
  }
}

Lines lines_of(const FieldData& field, float near) {
  Lines lines;
  lines.first.resize(64 * std::size_t(field.bricks[1]) * std::size_t(field.bricks[2]) + 1);
  each_near(field, near, [&](std::size_t line, std::size_t) { ++lines.first[line + 1]; });
  for (std::size_t i = 1; i < lines.first.size(); ++i) lines.first[i] += lines.first[i - 1];
  lines.x.resize(lines.first.back());
  std::vector<std::uint32_t> next(lines.first.begin(), lines.first.end() - 1);
  each_near(field, near,
            [&](std::size_t line, std::size_t x) { lines.x[next[line]++] = std::uint16_t(x); });
  return lines;
}

float squared_along(const Lines& lines, std::size_t line, int x) {
  const auto begin = lines.x.begin() + lines.first[line],
             end = lines.x.begin() + lines.first[line + 1];
  const auto after = std::lower_bound(begin, end, x);
  float least = kNone;
  if (after != end) least = float((*after - x) * (*after - x));
  if (after != begin) least = std::min(least, float((after[-1] - x) * (after[-1] - x)));
  return least;
}

// The parabolas value[i] + (t - i)^2 that are least somewhere.
class Envelope {
 public:
  // Reads values[i * stride] for i < count.
  void build(const float* values, std::size_t count, std::size_t stride) {
    kept_.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const double v = values[i * stride];
      if (v == kNone) continue;
      const double own = v + double(i) * double(i);
      double from = -1e30;
      while (!kept_.empty()) {
        const Kept& last = kept_.back();
        from = (own - last.own) / (2 * (double(i) - last.at));
        if (from > last.from) break;
        kept_.pop_back();
        from = -1e30;
      }
      kept_.push_back({double(i), own, v, from});
    }
  }
  // The least at every eighth place, for `count` of them.
  template <class Out>
  void read(std::size_t count, Out&& out) const {
    std::size_t k = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (kept_.empty()) {
        out(i, kNone);
        continue;
      }
      const double t = 8 * double(i);
      while (k + 1 < kept_.size() && kept_[k + 1].from <= t) ++k;
      out(i, float(kept_[k].value + (t - kept_[k].at) * (t - kept_[k].at)));
    }
  }

 private:
  struct Kept {
    double at, own, value, from;
  };
  std::vector<Kept> kept_;
};

}  // namespace

std::vector<float> squared_to_nearest(const FieldData& field, double near, unsigned threads) {
  const Lines lines = lines_of(field, float(near));
  const std::size_t na = std::size_t(field.bricks[0]) + 1, nb = std::size_t(field.bricks[1]) + 1,
                    nc = std::size_t(field.bricks[2]) + 1;
  const std::size_t ny = 8 * (nb - 1), nz = 8 * (nc - 1);
  std::vector<float> out(na * nb * nc);
  sched::parallel_for(na, threads, [&](std::size_t a) {
    std::vector<float> line(ny), plane(nz * nb);
    Envelope envelope;
    for (std::size_t z = 0; z < nz; ++z) {
      for (std::size_t y = 0; y < ny; ++y) line[y] = squared_along(lines, z * ny + y, int(8 * a));
      envelope.build(line.data(), ny, 1);
      envelope.read(nb, [&](std::size_t b, float v) { plane[z * nb + b] = v; });
    }
    for (std::size_t b = 0; b < nb; ++b) {
      envelope.build(&plane[b], nz, nb);
      envelope.read(nc, [&](std::size_t c, float v) { out[(c * nb + b) * na + a] = v; });
    }
  });
  return out;
}

}  // namespace h6::io
