// SPDX-License-Identifier: Apache-2.0
// gauss_weights_test.cpp - shares of stiffness on the Gauss map.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "kernels/weights/gauss_weights.h"
#include "tests/kernels/kernel_test.h"
#include "tests/support/near.h"
#include "tests/support/sanitized.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

constexpr Hat kHats[] = {Hat::normal, Hat::sum, Hat::product};

// Contacts in columns that start off alignment and are followed by NaN.
struct Contacts {
  Contacts(std::size_t n, std::size_t shift)
      : nx(n, shift),
        ny(n, shift + 1),
        nz(n, shift),
        tx(n, shift),
        ty(n, shift + 2),
        tz(n, shift),
        facing(n, shift),
        depth(n, shift + 3),
        count(n) {}
  DirectionsView view(bool weighted) {
    return {nx.begin(),
            ny.begin(),
            nz.begin(),
            tx.begin(),
            ty.begin(),
            tz.begin(),
            weighted ? facing.begin() : nullptr,
            weighted ? depth.begin() : nullptr,
            count};
  }
  void set(std::size_t i, const double n[3], const double t[3], double c, double s) {
    nx[i] = float(n[0]), ny[i] = float(n[1]), nz[i] = float(n[2]);
    tx[i] = float(t[0]), ty[i] = float(t[1]), tz[i] = float(t[2]);
    facing[i] = float(c), depth[i] = float(s);
  }
  Column nx, ny, nz, tx, ty, tz, facing, depth;
  std::size_t count;
};

// Contacts on a few walls, slightly rough, some of them facing away or barely touching. Odd seeds:
// wall by wall, as a shell in spatial order has them; even: mixed.
Contacts random_contacts(std::size_t n, std::size_t shift, std::uint64_t seed) {
  Random random(seed);
  double walls[5][3];
  for (auto& wall : walls) random.direction(wall);
  Contacts c(n, shift);
  for (std::size_t i = 0; i < n; ++i) {
    double noise[3], normal[3], torque[3];
    random.direction(noise);
    const double* wall = walls[seed % 2 == 1 ? i * 5 / n : random.below(5)];
    double length2 = 0;
    for (int k = 0; k < 3; ++k) {
      normal[k] = wall[k] + 0.02 * random.uniform(0, 1) * noise[k];
      length2 += normal[k] * normal[k];
    }
    for (double& v : normal) v /= std::sqrt(length2);
    random.direction(torque);
    for (double& v : torque) v *= random.uniform(0, 1);
    const double facing = i % 7 == 3 ? 0.0 : std::min(1.0, random.uniform(0, 2));
    c.set(i, normal, torque, facing, i % 11 == 5 ? 0.0 : random.uniform(0, 1e-3));
  }
  return c;
}

std::vector<float> weights(const DirectionsView& c, Hat hat, const GaussWidths& widths) {
  std::vector<float> w(c.count, -1.0f);
  gauss_weights(c, hat, widths, 0, c.count, w.data());
  return w;
}

// Bound on the relative error: each of two hats carries the rounding of its differences and squares
// (a few 2^-24 of 1, where the hat itself may be small: absolute, against phi >= s_i), sums in
// blocks.
constexpr double kTolerance = 5e-6;

void agree_with_reference(Contacts& c, Hat hat, const GaussWidths& widths, bool weighted) {
  Column got(c.count, 1), want(c.count, 0);
  gauss_weights(c.view(weighted), hat, widths, 0, c.count, got.begin());
  gauss_weights_ref(c.view(weighted), hat, widths, 0, c.count, want.begin());
  double worst = 0;
  bool finite = true;
  for (std::size_t i = 0; i < c.count; ++i) {
    finite = finite && std::isfinite(got[i]);
    worst = std::max(worst, std::fabs(double{got[i]} - want[i]) / std::max(1e-3, double{want[i]}));
  }
  CHECK(finite);
  CHECK(worst <= kTolerance);
  CHECK(got.padding_untouched());
}

}  // namespace

TEST_CASE("gauss_weights: SIMD agrees with the reference on every target, count and alignment") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      for (Hat hat : kHats) {
        Contacts c = random_contacts(n, n % 5, 100 + n);
        agree_with_reference(c, hat, {0.05f, 1.0f}, true);
        agree_with_reference(c, hat, {0.01f, 0.01f}, false);
        agree_with_reference(c, hat, {2.0f, 2.0f}, n % 2 == 0);
        agree_with_reference(c, hat, {0.05f, 1.0f, true}, true);
        agree_with_reference(c, hat, {2.0f, 2.0f, true}, n % 2 == 0);
      }
    }
    for (std::uint64_t seed : {5, 6}) {
      Contacts many = random_contacts(h6::test::repeated(2001, 301), 3, seed);
      for (Hat hat : kHats) agree_with_reference(many, hat, {0.05f, 1.0f}, true);
    }
  });
}

TEST_CASE("gauss_weights: any split of the rows gives the same bits") {
  Contacts c = random_contacts(431, 1, 9);
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats) {
      const std::vector<float> whole = weights(c.view(true), hat, {0.05f, 1.0f});
      for (std::size_t slice : {1u, 2u, 3u, 7u, 64u, 200u}) {
        std::vector<float> pieces(c.count);
        for (std::size_t b = 0; b < c.count; b += slice) {
          gauss_weights(c.view(true), hat, {0.05f, 1.0f}, b, std::min(b + slice, c.count),
                        pieces.data());
        }
        CHECK(same_bits(whole.data(), pieces.data(), c.count));
      }
    }
  });
}

TEST_CASE("gauss_weights: alignment of the columns changes no bit") {
  on_every_target([](const std::string&) {
    Contacts a = random_contacts(133, 0, 4), b = random_contacts(133, 7, 4);
    for (Hat hat : kHats) {
      CHECK(weights(a.view(true), hat, {0.05f, 1.0f}) == weights(b.view(true), hat, {0.05f, 1.0f}));
    }
  });
}

TEST_CASE(
    "gauss_weights: coincident contacts share one contact's stiffness, whatever their number") {
  const double normal[3] = {0.6, 0, 0.8}, torque[3] = {0, 1, 0};
  on_every_target([&](const std::string&) {
    for (std::size_t n : {1u, 2u, 3u, 16u, 100u, h6::test::repeated(5000u, 500u)}) {
      Contacts c(n, 1);
      for (std::size_t i = 0; i < n; ++i) c.set(i, normal, torque, 1, 1e-3);
      for (Hat hat : kHats) {
        for (bool weighted : {false, true}) {
          const auto w = weights(c.view(weighted), hat, {0.01f, 0.01f});
          CHECK(std::accumulate(w.begin(), w.end(), 0.0) == h6::test::near(1.0).epsilon(1e-5));
        }
      }
    }
  });
}

TEST_CASE(
    "gauss_weights: a lone contact keeps its whole stiffness, its neighbours out of the hat") {
  Random random(2);
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats) {
      Contacts c(200, 2);
      for (std::size_t i = 0; i < c.count; ++i) {
        // Normals and torque directions a golden angle apart: no two within 0.01.
        const double z = 1 - (2 * i + 1.0) / c.count, r = std::sqrt(1 - z * z), a = 2.39996 * i;
        const double v[3] = {r * std::cos(a), r * std::sin(a), z};
        c.set(i, v, v, 1, random.uniform(1e-5, 1e-3));
      }
      for (float w : weights(c.view(true), hat, {0.01f, 0.01f})) {
        CHECK(w == h6::test::near(1.0).epsilon(1e-6));
      }
    }
  });
}

TEST_CASE("gauss_weights: the product hat tells torque directions apart, the normal hat does not") {
  const double normal[3] = {0, 0, 1}, left[3] = {1, 0, 0}, right[3] = {-1, 0, 0};
  Contacts c(2, 0);
  c.set(0, normal, left, 1, 1e-3);
  c.set(1, normal, right, 1, 1e-3);
  on_every_target([&](const std::string&) {
    CHECK(weights(c.view(true), Hat::product, {0.05f, 1.0f})[0] == h6::test::near(1.0));
    CHECK(weights(c.view(true), Hat::normal, {0.05f, 1.0f})[0] == h6::test::near(0.5));
    // As printed: 2 / (2 + 1).
    CHECK(weights(c.view(true), Hat::sum, {0.05f, 1.0f})[0] == h6::test::near(2.0 / 3));
  });
}

TEST_CASE(
    "gauss_weights: a contact that faces away or has no depth weighs nothing and takes nothing") {
  Contacts c = random_contacts(64, 1, 8);
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats) {
      const auto with = weights(c.view(true), hat, {0.05f, 1.0f});
      Contacts kept(64, 0);
      std::size_t n = 0;
      std::vector<std::size_t> source;
      for (std::size_t i = 0; i < c.count; ++i) {
        if (c.facing[i] == 0 || c.depth[i] == 0) {
          CHECK(with[i] == 0.0f);
          continue;
        }
        const double v[3] = {c.nx[i], c.ny[i], c.nz[i]}, t[3] = {c.tx[i], c.ty[i], c.tz[i]};
        kept.set(n++, v, t, c.facing[i], c.depth[i]);
        source.push_back(i);
      }
      kept.count = n;
      const auto without = weights(kept.view(true), hat, {0.05f, 1.0f});
      for (std::size_t k = 0; k < n; ++k) {
        CHECK(without[k] == h6::test::near(with[source[k]]).epsilon(kTolerance));
      }
    }
  });
}

TEST_CASE("gauss_weights: a contact that enters at depth 0 enters without a jump") {
  Contacts c = random_contacts(40, 0, 12);
  on_every_target([&](const std::string&) {
    const auto before = weights(c.view(true), Hat::product, {0.05f, 1.0f});
    const float old = c.depth[5];  // 0
    REQUIRE(old == 0.0f);
    c.depth[5] = 1e-10f;
    const auto after = weights(c.view(true), Hat::product, {0.05f, 1.0f});
    for (std::size_t i = 0; i < c.count; ++i) {
      if (i != 5) CHECK(std::fabs(after[i] - before[i]) <= 1e-4f);
    }
    CHECK(after[5] <= 1.0f);
    c.depth[5] = old;
  });
}

TEST_CASE("gauss_weights: the order of the contacts does not matter") {
  Contacts c = random_contacts(150, 0, 31);
  Contacts turned(150, 3);
  const auto source = [](std::size_t i) { return (i * 37 + 11) % 150; };
  for (std::size_t i = 0; i < c.count; ++i) {
    const std::size_t k = source(i);
    const double v[3] = {c.nx[k], c.ny[k], c.nz[k]}, t[3] = {c.tx[k], c.ty[k], c.tz[k]};
    turned.set(i, v, t, c.facing[k], c.depth[k]);
  }
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats) {
      const auto a = weights(c.view(true), hat, {0.05f, 1.0f});
      const auto b = weights(turned.view(true), hat, {0.05f, 1.0f});
      for (std::size_t i = 0; i < c.count; ++i) {
        CHECK(b[i] == h6::test::near(a[source(i)]).epsilon(kTolerance));
      }
    }
  });
}

TEST_CASE("gauss_weights: weights stay within 0 and 1 at any depth and width") {
  Random random(77);
  on_every_target([&](const std::string&) {
    for (float epsilon : {1e-30f, 1e-4f, 0.01f, 2.0f}) {
      Contacts c = random_contacts(50, 0, 5);
      for (std::size_t i = 0; i < c.count; ++i) {
        c.depth[i] = float(std::pow(10.0, random.uniform(-44, 2)));
      }
      for (Hat hat : kHats) {
        for (float w : weights(c.view(true), hat, {epsilon, epsilon})) {
          CHECK(w >= 0.0f);
          CHECK(w <= 1.0f + 1e-5f);
        }
      }
    }
  });
}
