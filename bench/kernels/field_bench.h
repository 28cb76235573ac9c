// SPDX-License-Identifier: Apache-2.0
// field_bench.h - a field and points for the sampling and culling benchmarks.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <vector>

#include "bench/kernels/kernel_bench.h"
#include "tests/kernels/field/analytic_field.h"

namespace h6::kernels::bench {

// A ball of 150 voxels radius in 384^3: 11 thousand bricks, 16 MB.
inline constexpr double kBall = 150;
inline const test::AnalyticField& ball_field() {
  static const test::AnalyticField field(48, 48, 48, [](const test::Point& p) {
    return test::sphere(p, {191.5, 191.5, 191.5}, kBall);
  });
  return field;
}

// The ball with cells within 2 voxels of its surface cut into quarters: one in `every` of them.
inline const test::AnalyticField& cut_field(int every) {
  const auto make = [](int n) {
    const auto distance = [](const test::Point& p) {
      return test::sphere(p, {191.5, 191.5, 191.5}, kBall);
    };
    return std::make_unique<test::AnalyticField>(
        48, 48, 48, distance, 3.0, 0.001, 1.0, [=](int x, int y, int z) {
          if (std::fabs(distance({x + 0.5, y + 0.5, z + 0.5})) > 2) return 1;
          return (x / 8 + y / 8 + z / 8) % n == 0 ? 4
                                                  : 1;  // all cells of some bricks, as at an edge
        });
  };
  static const auto all = make(1), some = make(10);
  return every == 1 ? *all : *some;
}

struct ShellPoints {
  std::vector<float> x, y, z, radius;

  // n points within `spread` voxels of the ball's surface, in Morton order as a shell has them.
  ShellPoints(std::size_t n, double spread) {
    Random random(11);
    std::vector<float> p[3];
    for (std::size_t i = 0; i < n; ++i) {
      double v[3];
      random.direction(v);
      const double r = kBall + random.uniform(-spread, spread);
      for (int k = 0; k < 3; ++k) p[k].push_back(float(191.5 + r * v[k]));
    }
    std::vector<std::uint64_t> code(n, 0);
    for (std::size_t i = 0; i < n; ++i) {
      for (int k = 0; k < 3; ++k) {
        const auto cell = static_cast<std::uint32_t>(p[k][i]);
        for (int bit = 0; bit < 10; ++bit)
          code[i] |= std::uint64_t{cell >> bit & 1} << (3 * bit + k);
      }
    }
    std::vector<std::size_t> order(n);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return code[a] < code[b]; });
    for (std::size_t i : order) {
      x.push_back(p[0][i]), y.push_back(p[1][i]), z.push_back(p[2][i]);
      radius.push_back(float(random.uniform(0, 6)));
    }
  }
};

}  // namespace h6::kernels::bench
