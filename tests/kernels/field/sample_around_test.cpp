// SPDX-License-Identifier: Apache-2.0
// sample_around_test.cpp - distances about points, against sample_field.
#include "kernels/field/sample_around.h"

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

// The kernels that sample at the ends of a cross.
using Kernel = void (*)(const FieldView&, const Affine&, const PointsView&, float, float* const*);
struct Pattern {
  Kernel kernel, reference;
  float step;
  float error;  // [voxel]
};
// The six of its columns from the given one on.
template <void (*kKernel)(const FieldView&, const Affine&, const PointsView&, float* const*),
          std::size_t kFirst>
void ends(const FieldView& field, const Affine& a, const PointsView& p, float, float* const* at) {
  std::vector<std::vector<float>> others(6, std::vector<float>(p.count));
  float* to[12];
  for (std::size_t c = 0; c < 12; ++c)
    to[c] = c / 6 == kFirst / 6 ? at[c % 6] : others[c % 6].data();
  kKernel(field, a, p, to);
}
const Pattern kPatterns[] = {{sample_cross, sample_cross_ref, 0.5f, 5e-5f},
                             {sample_cross, sample_cross_ref, 0.125f, 5e-5f},
                             {ends<sample_ends, 0>, ends<sample_ends_ref, 0>, 1.0f, 5e-5f},
                             {ends<sample_ends, 6>, ends<sample_ends_ref, 6>, 0.5f, 5e-5f}};

struct Samples {
  std::vector<Column> at;
  Samples(std::size_t n, std::size_t shift) {
    for (std::size_t c = 0; c < 6; ++c) at.emplace_back(n, shift + c % 2);
  }
  void take(Kernel kernel, const AnalyticField& field, const Affine& a, const PointsView& p,
            float step) {
    float* to[6];
    for (std::size_t c = 0; c < 6; ++c) to[c] = at[c].begin();
    kernel(field.view(), a, p, step, to);
  }
};

void agree(const Pattern& pattern, const AnalyticField& field, const Affine& a, Points& p,
           std::size_t n) {
  Samples got(n, 1), want(n, 0);
  got.take(pattern.kernel, field, a, p.view(n), pattern.step);
  for (std::size_t c = 0; c < 6; ++c) {
    Affine to = a;
    for (int axis = 0; axis < 3; ++axis) to.m[axis][3] += pattern.step * float(kEndSign[c][axis]);
    sample_field(field.view(), to, p.view(n), nullptr, n, want.at[c].begin(), nullptr, nullptr,
                 nullptr);
    for (std::size_t i = 0; i < n; ++i) {
      const float a_value = got.at[c][i], b_value = want.at[c][i];
      CHECK((a_value == b_value || std::fabs(a_value - b_value) <= pattern.error));
    }
    CHECK(got.at[c].padding_untouched());
  }
}

}  // namespace

TEST_CASE("sample_around: every place has the distance of sample_field on every target and count") {
  on_every_target([](const std::string&) {
    Random random(7);
    for (std::size_t n = 0; n <= 67; ++n) {
      Points wide(n, n % 5, random, -20, 150), inside(n, n % 3, random, 40, 80);
      if (n > 20) wide.y[n / 2] = std::numeric_limits<float>::quiet_NaN();
      for (const Pattern& pattern : kPatterns)
        for (const Affine& a : {kIdentity, kTurned})
          for (const AnalyticField* field : {&clutter_field(), &refined_field()}) {
            agree(pattern, *field, a, wide, n);
            agree(pattern, *field, a, inside, n);
          }
    }
  });
}

TEST_CASE("sample_around: the places lie where their signs say") {
  Random random(8);
  const std::size_t n = 500;
  Points p(n, 0, random, 30, 90), moved(n, 0, random, 0, 1);
  std::vector<float> d(n);
  for (const Pattern& pattern : kPatterns) {
    Samples got(n, 0), ref(n, 0);
    got.take(pattern.kernel, clutter_field(), kIdentity, p.view(n), pattern.step);
    ref.take(pattern.reference, clutter_field(), kIdentity, p.view(n), pattern.step);
    for (std::size_t c = 0; c < 6; ++c) {
      const int* sign = kEndSign[c];
      for (std::size_t i = 0; i < n; ++i) {
        moved.x[i] = p.x[i] + pattern.step * float(sign[0]);
        moved.y[i] = p.y[i] + pattern.step * float(sign[1]);
        moved.z[i] = p.z[i] + pattern.step * float(sign[2]);
      }
      sample_field_ref(clutter_field().view(), kIdentity, moved.view(n), nullptr, n, d.data(),
                       nullptr, nullptr, nullptr);
      std::size_t apart = 0;  // a position may round to another cell
      for (std::size_t i = 0; i < n; ++i)
        apart += std::fabs(got.at[c][i] - d[i]) > 1e-3f || std::fabs(ref.at[c][i] - d[i]) > 1e-3f;
      CHECK(apart <= n / 100);
    }
  }
}

TEST_CASE("sample_around: no point's bits depend on its neighbours") {
  on_every_target([](const std::string&) {
    Random random(9);
    const std::size_t n = 64;
    Points p(n, 0, random, 40, 80);
    for (const Pattern& pattern : kPatterns) {
      Samples alone(n, 0), beside(n, 0);
      alone.take(pattern.kernel, clutter_field(), kTurned, p.view(n), pattern.step);
      Points other(n, 0, random, -20, 150);
      for (std::size_t i = 0; i < n; ++i) {
        if (i % 3 == 0) continue;
        other.x[i] = p.x[i], other.y[i] = p.y[i], other.z[i] = p.z[i];
      }
      other.x[30] = std::numeric_limits<float>::quiet_NaN();
      beside.take(pattern.kernel, clutter_field(), kTurned, other.view(n), pattern.step);
      for (std::size_t c = 0; c < 6; ++c)
        for (std::size_t i = 0; i < n; ++i)
          if (i % 3 != 0) CHECK(alone.at[c][i] == beside.at[c][i]);
    }
  });
}
