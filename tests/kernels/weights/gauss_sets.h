// SPDX-License-Identifier: Apache-2.0
// gauss_sets.h - typical sets of contacts on the Gauss map, for tests of the density.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "kernels/weights/gauss_weights.h"
#include "tests/kernels/kernel_test.h"

namespace h6::kernels::test {

inline constexpr Hat kHats[] = {Hat::normal, Hat::sum, Hat::product};
inline constexpr GaussWidths kPaper{0.01f, 0.01f}, kRobust{0.05f, 1.0f};
inline GaussWidths widths_of(Hat hat) { return hat == Hat::product ? kRobust : kPaper; }

// Relative to each weight.
inline constexpr double kTolerance = 1e-5;

// Columns that start off alignment and are followed by NaN.
struct Contacts {
  Contacts(std::size_t n, std::size_t shift)
      : column{Column(n, shift), Column(n, shift + 1), Column(n, shift),     Column(n, shift + 3),
               Column(n, shift), Column(n, shift + 2), Column(n, shift + 1), Column(n, shift)},
        count(n) {}
  DirectionsView view(bool weighted) {
    return {column[0].begin(),
            column[1].begin(),
            column[2].begin(),
            column[3].begin(),
            column[4].begin(),
            column[5].begin(),
            weighted ? column[6].begin() : nullptr,
            weighted ? column[7].begin() : nullptr,
            count};
  }
  void set(std::size_t i, const double n[3], const double t[3], double facing, double depth) {
    for (int k = 0; k < 3; ++k) column[k][i] = float(n[k]), column[3 + k][i] = float(t[k]);
    column[6][i] = float(facing), column[7][i] = float(depth);
  }
  Column column[8];
  std::size_t count;
};

inline void make_unit(double v[3]) {
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  for (int k = 0; k < 3; ++k) v[k] /= length;
}

inline void near_to(Random& random, const double v[3], double width, double out[3]) {
  double noise[3];
  random.direction(noise);
  const double length = width * (random.uniform(0, 1) + random.uniform(0, 1));
  for (int k = 0; k < 3; ++k) out[k] = v[k] + length * noise[k];
  make_unit(out);
}

enum class Set { spread, clump, equal, line, one_normal, two_clusters, walls, arms };
inline constexpr Set kSets[] = {Set::spread,     Set::clump,        Set::equal, Set::line,
                                Set::one_normal, Set::two_clusters, Set::walls, Set::arms};

// `width`: of the hats over N and T.
inline Contacts contacts_of(Set set, std::size_t n, GaussWidths width, std::size_t shift = 0) {
  Random random(1000 + static_cast<std::uint64_t>(set));
  Contacts c(n, shift);
  double poles[6][3];
  for (auto& pole : poles) random.direction(pole);
  for (std::size_t i = 0; i < n; ++i) {
    double normal[3], torque[3];
    random.direction(normal);
    random.direction(torque);
    const double angle = random.uniform(-M_PI, M_PI);
    const double circle[3] = {0.6 * std::cos(angle), std::sin(angle), 0.8 * std::cos(angle)};
    switch (set) {
      case Set::spread:
        break;
      case Set::clump:
        near_to(random, poles[0], width.normal, normal);
        near_to(random, poles[1], width.torque, torque);
        break;
      case Set::equal:
        std::copy_n(poles[0], 3, normal);
        std::copy_n(poles[1], 3, torque);
        break;
      case Set::line:
        std::copy_n(circle, 3, normal);
        std::copy_n(circle, 3, torque);
        break;
      case Set::one_normal:
        std::copy_n(poles[0], 3, normal);
        break;
      case Set::two_clusters: {
        // Just within reach of each other.
        double other[3] = {0, 0, 1}, pole[3] = {0, 0, 1};
        if (random.below(2) == 0) pole[0] = 0.97 * width.normal, other[0] = 0.9 * width.torque;
        make_unit(pole), make_unit(other);
        near_to(random, pole, 0.01 * width.normal, normal);
        near_to(random, other, 0.01 * width.torque, torque);
        break;
      }
      case Set::walls:
        near_to(random, poles[i * 6 / n], 0.02, normal);
        break;
      case Set::arms:  // not unit: the length of an arm in T
        near_to(random, poles[i * 6 / n], 0.02, normal);
        for (double& v : torque) v *= random.uniform(0, 1);
        break;
    }
    const double facing = i % 7 == 3 ? 0.0 : std::min(1.0, random.uniform(0, 2));
    c.set(i, normal, torque, facing, i % 11 == 5 ? 0.0 : random.uniform(0, 1e-3));
  }
  return c;
}

// The weights of the specification, every `step`th of them.
inline std::vector<float> reference_of(const DirectionsView& c, Hat hat, const GaussWidths& widths,
                                       std::size_t step = 1) {
  std::vector<float> want(c.count);
  for (std::size_t i = 0; i < c.count; i += step)
    gauss_weights_ref(c, hat, widths, i, i + 1, want.data());
  return want;
}

// Largest error of every `step`th weight.
inline double worst_of(const std::vector<float>& got, const std::vector<float>& want,
                       std::size_t step = 1) {
  double worst = 0;
  for (std::size_t i = 0; i < got.size(); i += step) {
    const double error = std::fabs(double{got[i]} - want[i]);
    worst = std::max(worst, want[i] > 0 ? error / want[i] : got[i] == 0 ? 0.0 : HUGE_VAL);
    if (!std::isfinite(got[i])) worst = HUGE_VAL;
  }
  return worst;
}

// `run` (a view, hats, widths, memory, weights) in exactly `bytes`, from an odd address.
template <class Run>
std::vector<float> weights_in(std::size_t bytes, const DirectionsView& c, Hat hat,
                              const GaussWidths& widths, const Run& run) {
  std::vector<unsigned char> memory(bytes + 32, 0xa5);
  Column weight(c.count, 1);
  run(c, hat, widths, memory.data() + 16 + c.count % 16, weight.begin());
  CHECK(weight.padding_untouched());
  for (std::size_t k = 0; k < 16; ++k) {
    CHECK(memory[k] == 0xa5);
    if (k >= c.count % 16) CHECK(memory[bytes + 16 + k] == 0xa5);
  }
  return {weight.begin(), weight.begin() + c.count};
}

}  // namespace h6::kernels::test
