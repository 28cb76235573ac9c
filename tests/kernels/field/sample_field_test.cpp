// SPDX-License-Identifier: Apache-2.0
// sample_field_test.cpp - samples, gradients and bounds of a field in its hot layout.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "kernels/field/sample_field.h"
#include "tests/kernels/field/analytic_field.h"
#include "tests/kernels/kernel_test.h"
#include "tests/support/near.h"
#include "tests/support/sanitized.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

struct Points {
  Points(std::size_t n, std::size_t shift)
      : x(n, shift), y(n, shift + 1), z(n, shift + 2), count(n) {}
  void set(std::size_t i, double px, double py, double pz) {
    x[i] = float(px), y[i] = float(py), z[i] = float(pz);
  }
  PointsView view() { return {x.begin(), y.begin(), z.begin(), count}; }
  Column x, y, z;
  std::size_t count;
};

struct Samples {
  Samples(std::size_t n, std::size_t shift)
      : distance(n, shift), gx(n, shift), gy(n, shift + 1), gz(n, shift + 3) {}
  Column distance, gx, gy, gz;
};

using Kernel = decltype(&sample_field);

Samples sample(Kernel kernel, const AnalyticField& field, const Affine& a, Points& p,
               const std::uint32_t* rows, std::size_t count, bool gradient = true) {
  Samples s(count, 1);
  kernel(field.view(), a, p.view(), rows, count, s.distance.begin(),
         gradient ? s.gx.begin() : nullptr, gradient ? s.gy.begin() : nullptr,
         gradient ? s.gz.begin() : nullptr);
  return s;
}

// The distance at one point of the field.
float distance_at(const AnalyticField& field, double x, double y, double z) {
  Points p(1, 0);
  p.set(0, x, y, z);
  return sample(sample_field, field, kIdentity, p, nullptr, 1, false).distance[0];
}

// The distance from v to the nearest of the planes that are `step` apart.
double to_plane(double v, double step) { return std::fabs(v - step * std::nearbyint(v / step)); }

double to_faces(const double q[3], double step) {
  return std::min({to_plane(q[0], step), to_plane(q[1], step), to_plane(q[2], step)});
}

// Near and far entries do not agree on the face between them, and the gradient jumps between unit
// cells: rounding of the position may pick either side there.
void agree(const AnalyticField& field, const Affine& a, Points& p, const std::uint32_t* rows,
           std::size_t count) {
  Samples got = sample(sample_field, field, a, p, rows, count);
  Samples want = sample(sample_field_ref, field, a, p, rows, count);
  double worst = 0, worst_slope = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t r = rows ? rows[k] : k;
    double q[3];
    bool grid = true;
    for (int i = 0; i < 3; ++i) {
      q[i] = double{a.m[i][0]} * p.x[r] + double{a.m[i][1]} * p.y[r] + double{a.m[i][2]} * p.z[r] +
             a.m[i][3];
      grid = grid && std::fabs(q[i]) > 1e-3 && std::fabs(q[i] - field.last(i)) > 1e-3;
      q[i] = std::min(std::max(q[i], 0.0), field.last(i));
    }
    const bool refined = field.def().refined != nullptr;
    if (to_faces(q, refined ? 1 : 8) < 1e-3 && grid) continue;
    worst = std::max(worst, std::fabs(double{got.distance[k]} - want.distance[k]) /
                                std::max(1.0, double{want.distance[k]}));
    if (!grid || to_faces(q, refined ? 0.25 : 1) < 1e-3) continue;
    for (Column Samples::*g : {&Samples::gx, &Samples::gy, &Samples::gz}) {
      worst_slope = std::max(worst_slope, std::fabs(double{(got.*g)[k]} - (want.*g)[k]));
    }
  }
  // Coordinates up to 150 voxels, so a position rounds by 150 * 2^-23 or so; slopes reach 1 a voxel
  // and change by 2 a voxel at most.
  CHECK(worst <= 2e-4);
  CHECK(worst_slope <= 4e-4);
  CHECK(got.distance.padding_untouched());
  CHECK(got.gx.padding_untouched());
  CHECK(got.gy.padding_untouched());
  CHECK(got.gz.padding_untouched());
  Samples plain = sample(sample_field, field, a, p, rows, count, false);
  CHECK(same_bits(plain.distance.begin(), got.distance.begin(), count));
}

// A motion of some degrees about the field's middle.
constexpr Affine kTurned = {{{0.96f, -0.28f, 0.0f, 20.25f},
                             {0.2688f, 0.9216f, -0.28f, 5.5f},
                             {0.0784f, 0.2688f, 0.96f, -18.125f}}};

}  // namespace

TEST_CASE("sample_field: SIMD agrees with the reference on every target, count and alignment") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Random random(1);
    for (std::size_t n = 0; n <= 67; ++n) {
      Points p(n, n % 5);
      for (std::size_t i = 0; i < n; ++i) {
        p.set(i, random.uniform(-20, 150), random.uniform(-20, 150), random.uniform(-20, 160));
      }
      agree(field, kTurned, p, nullptr, n);
      if (n == 0) continue;
      std::vector<std::uint32_t> rows(n);
      for (auto& r : rows) r = std::uint32_t(random.below(n));
      agree(field, kTurned, p, rows.data(), n);
    }
    Points p(20000, 3);
    for (std::size_t i = 0; i < p.count; ++i) {
      p.set(i, random.uniform(-5, 132), random.uniform(-5, 140), random.uniform(-5, 148));
    }
    agree(field, kIdentity, p, nullptr, p.count);
  });
}

TEST_CASE("sample_field: SIMD agrees with the reference where cells have finer samples") {
  const AnalyticField& field = refined_field();
  REQUIRE(field.def().half_count > 10000);
  REQUIRE(field.def().quarter_count > 10000);
  on_every_target([&](const std::string&) {
    Random random(2);
    for (std::size_t n = 1; n <= 67; ++n) {
      Points p(n, n % 5);
      for (std::size_t i = 0; i < n; ++i)
        p.set(i, random.uniform(-5, 132), random.uniform(-5, 140), random.uniform(-5, 148));
      agree(field, kTurned, p, nullptr, n);
    }
    Points p(20000, 3);
    for (std::size_t i = 0; i < p.count; ++i) {
      // Near a sphere's surface, where every cell is cut by chance; and at its last node, too.
      p.set(i, random.uniform(16, 64), random.uniform(16, 64), random.uniform(16, 64));
    }
    agree(field, kIdentity, p, nullptr, p.count);
  });
}

TEST_CASE("sample_field: a cut cell is right to the curvature of its own samples") {
  const AnalyticField plain(8, 8, 8, [](const Point& p) { return sphere(p, {30, 31, 32}, 9.0); });
  for (const int factor : {2, 4}) {
    const AnalyticField cut(
        8, 8, 8,
        [](const Point& p) {
          return sphere(p, {30, 31, 32}, 9.0);
        },
        3.0, 0.001, 1.0, [&](int, int, int) { return factor; });
    Random random(3);
    double worst = 0, worst_plain = 0;
    for (int i = 0; i < 20000; ++i) {
      const Point p{random.uniform(18, 42), random.uniform(18, 42), random.uniform(18, 42)};
      if (std::fabs(plain.distance(p)) > 2.5) continue;
      worst = std::max(worst, std::fabs(distance_at(cut, p.x, p.y, p.z) - plain.distance(p)));
      worst_plain =
          std::max(worst_plain, std::fabs(distance_at(plain, p.x, p.y, p.z) - plain.distance(p)));
    }
    // The error falls with the square of the spacing, down to the rounding of samples.
    CHECK(worst_plain > 0.02);
    CHECK(worst < worst_plain / (factor * factor) + 1e-3);
  }
}

TEST_CASE("sample_field: a point's sample does not depend on where in the call it stands") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Random random(4);
    Points p(67, 2);
    for (std::size_t i = 0; i < p.count; ++i) {
      p.set(i, random.uniform(-5, 132), random.uniform(-5, 140), random.uniform(-5, 148));
    }
    Samples whole = sample(sample_field, field, kTurned, p, nullptr, p.count);
    for (std::uint32_t i = 0; i < p.count; ++i) {
      Samples one = sample(sample_field, field, kTurned, p, &i, 1);
      CHECK(same_bits(one.distance.begin(), &whole.distance[i], 1));
      CHECK(same_bits(one.gy.begin(), &whole.gy[i], 1));
    }
  });
}

TEST_CASE("sample_field: a linear field is reproduced exactly, value and slope") {
  // Multiples of 1/1024 at every node, band wide enough for bricks everywhere.
  const auto linear = [](const Point& p) { return 0.5 * p.x - 0.25 * p.y + 0.125 * p.z - 2.0; };
  const AnalyticField field(3, 3, 3, linear, 100.0, 1.0);
  on_every_target([&](const std::string&) {
    Random random(6);
    Points p(500, 1);
    for (std::size_t i = 0; i < p.count; ++i) {
      // 1/64 of a voxel: every product fits a float.
      const auto snapped = [&] { return double(random.below(23 * 64 + 1)) / 64; };
      p.set(i, snapped(), snapped(), snapped());
    }
    p.set(0, 0, 0, 0);
    p.set(1, 23, 23, 23);
    Samples s = sample(sample_field, field, kIdentity, p, nullptr, p.count);
    for (std::size_t i = 0; i < p.count; ++i) {
      CHECK(s.distance[i] == linear({p.x[i], p.y[i], p.z[i]}));
      CHECK(s.gx[i] == 0.5f);
      CHECK(s.gy[i] == -0.25f);
      CHECK(s.gz[i] == 0.125f);
    }
  });
}

TEST_CASE("sample_field: near the surface it is the distance to within interpolation") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Random random(8);
    for (int i = 0; i < h6::test::repeated(2000, 200); ++i) {
      // Around the large sphere, of radius 22.3, the error is 3/8 of the curvature and the rounding
      // of samples.
      double n[3];
      random.direction(n);
      const double r = 22.3 + random.uniform(-2.5, 2.5);
      const Point p{40 + r * n[0], 40 + r * n[1], 40 + r * n[2]};
      CHECK(std::fabs(distance_at(field, p.x, p.y, p.z) - field.distance(p)) <= 0.375 / 19 + 2e-3);
    }
  });
}

TEST_CASE(
    "sample_field: the gradient is the slope of the distance in bricks and out of them, and points "
    "where it grows in far cells") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Random random(10);
    const double h = 1.0 / 64;
    int near = 0, far = 0, outside = 0, turned = 0;
    for (int i = 0; i < h6::test::repeated(4000, 2000); ++i) {
      const double q[3] = {random.uniform(-20, 147), random.uniform(-20, 155),
                           random.uniform(-20, 163)};
      double c[3];
      for (int k = 0; k < 3; ++k) c[k] = std::min(std::max(q[k], 0.0), field.last(k));
      const bool out = c[0] != q[0] || c[1] != q[1] || c[2] != q[2];
      bool kink = false;  // within the stencil
      for (int k = 0; k < 3; ++k) {
        kink = kink || to_plane(c[k] == q[k] ? q[k] : 0.5, 1) < 2 * h || std::fabs(q[k]) < 2 * h ||
               std::fabs(q[k] - field.last(k)) < 2 * h;
      }
      Points p(1, 0);
      p.set(0, q[0], q[1], q[2]);
      Samples s = sample(sample_field, field, kIdentity, p, nullptr, 1);
      if (kink || (out && distance_at(field, c[0], c[1], c[2]) <= 0.1)) continue;
      if (!field.near({c[0], c[1], c[2]})) {
        ++(out ? outside : far);
        double dot = 0, truth2 = 0;
        for (int k = 0; k < 3; ++k) {
          double a[3] = {q[0], q[1], q[2]}, b[3] = {q[0], q[1], q[2]};
          a[k] += h, b[k] -= h;
          const double t = field.distance({a[0], a[1], a[2]}) - field.distance({b[0], b[1], b[2]});
          dot += t * (k == 0 ? s.gx[0] : k == 1 ? s.gy[0] : s.gz[0]);
          truth2 += t * t;
        }
        const double length = std::hypot(s.gx[0], s.gy[0], s.gz[0]);
        CHECK(length < 1.8);
        turned += dot < 0.8 * length * std::sqrt(truth2);
        continue;
      }
      ++(out ? outside : near);
      const double slope[3] = {double{distance_at(field, q[0] + h, q[1], q[2])} -
                                   distance_at(field, q[0] - h, q[1], q[2]),
                               double{distance_at(field, q[0], q[1] + h, q[2])} -
                                   distance_at(field, q[0], q[1] - h, q[2]),
                               double{distance_at(field, q[0], q[1], q[2] + h)} -
                                   distance_at(field, q[0], q[1], q[2] - h)};
      // Trilinear is linear along an axis: only rounding. Outside a little curvature comes on top.
      CHECK(std::abs(s.gx[0] - slope[0] / (2 * h)) < 2e-3);
      CHECK(std::abs(s.gy[0] - slope[1] / (2 * h)) < 2e-3);
      CHECK(std::abs(s.gz[0] - slope[2] / (2 * h)) < 2e-3);
    }
    CHECK(near > 100);
    CHECK(far > 100);
    CHECK(outside > 100);
    CHECK(turned < 0.2 * (far + outside));  // where two parts are nearly as far
  });
}

TEST_CASE("sample_field: the distance is continuous across the faces between bricks") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Random random(12);
    int crossings = 0;
    for (int i = 0; i < h6::test::repeated(4000, 2000); ++i) {
      double a[3] = {random.uniform(1, 126), random.uniform(1, 134), random.uniform(1, 142)};
      const int axis = i % 3;
      a[axis] = 8 * std::max(1.0, std::floor(a[axis] / 8));
      double b[3] = {a[0], a[1], a[2]};
      b[axis] = std::nextafter(float(a[axis]), 0.0f);
      if (!field.near({a[0], a[1], a[2]}) || !field.near({b[0], b[1], b[2]})) continue;
      ++crossings;
      const float gap = distance_at(field, a[0], a[1], a[2]) - distance_at(field, b[0], b[1], b[2]);
      CHECK(std::fabs(gap) <= 5e-5f);
    }
    CHECK(crossings > 200);
  });
}

TEST_CASE(
    "sample_field: outside the grid it grows as the distance to the grid and never exceeds the "
    "truth") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Random random(14);
    int tested = 0;
    for (int i = 0; i < h6::test::repeated(3000, 2000); ++i) {
      const Point p{random.uniform(-200, 330), random.uniform(-200, 330),
                    random.uniform(-200, 330)};
      const double ox = p.x - std::clamp(p.x, 0.0, field.last(0));
      const double oy = p.y - std::clamp(p.y, 0.0, field.last(1));
      const double oz = p.z - std::clamp(p.z, 0.0, field.last(2));
      const double off = std::sqrt(ox * ox + oy * oy + oz * oz);
      if (off == 0) continue;
      ++tested;
      const float d = distance_at(field, p.x, p.y, p.z);
      CHECK(d >= off * (1 - 1e-6));
      CHECK(d <= field.distance(p) + 1e-3);
      const double inner = distance_at(field, p.x - ox, p.y - oy, p.z - oz);
      CHECK(d == h6::test::near(std::hypot(off, std::max(inner, 0.0))).epsilon(1e-5));
    }
    CHECK(tested > 1000);
  });
}

TEST_CASE("sample_field: a point that is not finite is infinitely far, with gradient 0") {
  const AnalyticField& field = clutter_field();
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity()};
  on_every_target([&](const std::string&) {
    for (Kernel kernel : {&sample_field, &sample_field_ref}) {
      Points p(40, 1);
      for (std::size_t i = 0; i < p.count; ++i) {
        p.set(i, 20, 30, 40);
        Column* axis[3] = {&p.x, &p.y, &p.z};
        if (i % 4 == 1) (*axis[i % 3])[i] = bad[i % 3];
        if (i == 39) p.set(i, 3e38, 3e38, -3e38);  // finite, its distance is not
      }
      Samples s = sample(kernel, field, kIdentity, p, nullptr, p.count);
      for (std::size_t i = 0; i < p.count; ++i) {
        CHECK(!std::isnan(s.gx[i]));
        if (i == 39) {
          CHECK(s.distance[i] == std::numeric_limits<float>::infinity());
        } else if (i % 4 == 1) {
          CHECK(s.distance[i] == std::numeric_limits<float>::infinity());
          CHECK(s.gx[i] == 0.0f);
          CHECK(s.gy[i] == 0.0f);
          CHECK(s.gz[i] == 0.0f);
        } else {
          CHECK(std::isfinite(s.distance[i]));
        }
      }
    }
  });
}

TEST_CASE("sample_field: rows of the largest field that can be addressed are found") {
  // A table alone: bricks lie at rows 0 and 1.4 million, which the kernel must reach without
  // overflow.
  const std::size_t row = 1'400'000;
  REQUIRE(row < kMaxBricks);
  std::vector<std::int16_t> bricks;
  bricks.reserve((row + 1) * kBrickStride);  // untouched pages cost nothing
  std::int16_t* pool = bricks.data();
  std::fill_n(pool, kBrickStride, std::int16_t(1024));
  std::fill_n(pool + row * kBrickStride, kBrickStride, std::int16_t(-2048));
  const std::int32_t table[2] = {0, std::int32_t(row)};
  const FieldView field{{2, 1, 1}, table, pool, nullptr};
  const float x[2] = {3.5f, 12.5f}, y[2] = {2, 6.5f}, z[2] = {1, 6.75f};
  on_every_target([&](const std::string&) {
    float distance[2];
    sample_field(field, kIdentity, {x, y, z, 2}, nullptr, 2, distance, nullptr, nullptr, nullptr);
    CHECK(distance[0] == 1.0f);
    CHECK(distance[1] == -2.0f);
  });
}
