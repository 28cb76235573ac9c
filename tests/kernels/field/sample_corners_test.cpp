// SPDX-License-Identifier: Apache-2.0
// sample_corners_test.cpp - distances about points, against sample_field.
#include "kernels/field/sample_corners.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "kernels/field/sample_field.h"
#include "tests/kernels/field/analytic_field.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

constexpr float kStep = 0.5f;

const AnalyticField& plain_field() {
  static const AnalyticField field(16, 17, 18, clutter);
  return field;
}
const AnalyticField& refined_field() {
  static const AnalyticField field(16, 17, 18, clutter, 3.0, 0.001, 1.0, scattered_cut);
  return field;
}

constexpr Affine kTurned = {{{0.96f, -0.28f, 0.0f, 20.25f},
                             {0.2688f, 0.9216f, -0.28f, 5.5f},
                             {0.0784f, 0.2688f, 0.96f, -18.125f}}};

struct Points {
  Column x, y, z;
  Points(std::size_t n, std::size_t shift, Random& random, double low, double high)
      : x(n, shift), y(n, shift + 1), z(n, shift + 2) {
    for (std::size_t i = 0; i < n; ++i)
      for (Column* c : {&x, &y, &z}) (*c)[i] = float(random.uniform(low, high));
  }
  PointsView view(std::size_t n) { return {x.begin(), y.begin(), z.begin(), n}; }
};

struct Corners {
  std::vector<Column> at;
  Corners(std::size_t n, std::size_t shift) {
    for (std::size_t c = 0; c < 4; ++c) at.emplace_back(n, shift + c % 2);
  }
  template <class Kernel>
  void sample(Kernel kernel, const AnalyticField& field, const Affine& a, const PointsView& p) {
    float* const to[4] = {at[0].begin(), at[1].begin(), at[2].begin(), at[3].begin()};
    kernel(field.view(), a, p, kStep, to);
  }
};

void agree(const AnalyticField& field, const Affine& a, Points& p, std::size_t n) {
  Corners got(n, 1), want(n, 0);
  got.sample(sample_corners, field, a, p.view(n));
  for (int c = 0; c < 4; ++c) {
    Affine to = a;
    for (int axis = 0; axis < 3; ++axis) to.m[axis][3] += kStep * float(kCornerSign[c][axis]);
    sample_field(field.view(), to, p.view(n), nullptr, n, want.at[c].begin(), nullptr, nullptr,
                 nullptr);
    CHECK(same_bits(got.at[c].begin(), want.at[c].begin(), n));
    CHECK(got.at[c].padding_untouched());
  }
}

}  // namespace

TEST_CASE("sample_corners: every corner has the bits of sample_field on every target and count") {
  on_every_target([](const std::string&) {
    Random random(7);
    for (std::size_t n = 0; n <= 67; ++n) {
      Points wide(n, n % 5, random, -20, 150), inside(n, n % 3, random, 40, 80);
      if (n > 20) wide.y[n / 2] = std::numeric_limits<float>::quiet_NaN();
      for (const Affine& a : {kIdentity, kTurned}) {
        for (const AnalyticField* field : {&plain_field(), &refined_field()}) {
          agree(*field, a, wide, n);
          agree(*field, a, inside, n);
        }
      }
    }
  });
}

TEST_CASE("sample_corners: the corners lie half a voxel away along every axis") {
  Random random(8);
  const std::size_t n = 500;
  Points p(n, 0, random, 30, 90);
  Corners at(n, 0);
  at.sample(sample_corners, plain_field(), kIdentity, p.view(n));
  Corners ref(n, 0);
  ref.sample(sample_corners_ref, plain_field(), kIdentity, p.view(n));
  std::vector<float> x(n), y(n), z(n), d(n);
  for (int c = 0; c < 4; ++c) {
    const float sx = c < 2 ? 0.5f : -0.5f, sy = c % 2 == 0 ? 0.5f : -0.5f;
    for (std::size_t i = 0; i < n; ++i)
      x[i] = p.x[i] + sx, y[i] = p.y[i] + sy, z[i] = p.z[i] + 2 * sx * sy;
    sample_field_ref(plain_field().view(), kIdentity, {x.data(), y.data(), z.data(), n}, nullptr, n,
                     d.data(), nullptr, nullptr, nullptr);
    std::size_t apart = 0;  // a position may round to another cell
    for (std::size_t i = 0; i < n; ++i)
      apart += std::fabs(at.at[c][i] - d[i]) > 1e-3f || std::fabs(ref.at[c][i] - d[i]) > 1e-3f;
    CHECK(apart <= n / 100);
  }
}
