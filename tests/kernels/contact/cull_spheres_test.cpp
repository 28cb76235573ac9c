// SPDX-License-Identifier: Apache-2.0
// cull_spheres_test.cpp - culling loses no contact.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "kernels/contact/cull_spheres.h"
#include "kernels/field/sample_field.h"
#include "tests/kernels/field/analytic_field.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

struct Spheres {
  Spheres(std::size_t n, std::size_t shift)
      : x(n, shift), y(n, shift + 1), z(n, shift + 2), radius(n, shift + 3), count(n) {}
  SpheresView view() { return {x.begin(), y.begin(), z.begin(), radius.begin(), count}; }
  Column x, y, z, radius;
  std::size_t count;
};

Spheres random_spheres(std::size_t n, std::size_t shift, std::uint64_t seed) {
  Random random(seed);
  Spheres s(n, shift);
  for (std::size_t i = 0; i < n; ++i) {
    s.x[i] = float(random.uniform(-10, 138));
    s.y[i] = float(random.uniform(-10, 146));
    s.z[i] = float(random.uniform(-10, 154));
    s.radius[i] = i % 5 == 0 ? 0.0f : float(random.uniform(0, 12));
  }
  return s;
}

// The survivors, and whether nothing past `count` was written.
std::vector<std::uint32_t> cull(const AnalyticField& field, Spheres& s, float scale,
                                const Reach& reach, float margin, const std::uint32_t* rows,
                                std::uint32_t first, std::size_t count,
                                std::vector<float>* clearance = nullptr) {
  std::vector<std::uint32_t> out(count + 64, 0xdeadbeef);
  Column d(count, 1);
  const std::size_t n = cull_spheres(field.view(), kIdentity, s.view(), scale, reach, margin, rows,
                                     first, count, out.data(), clearance ? d.begin() : nullptr);
  REQUIRE(n <= count);
  CHECK(std::count(out.begin() + count, out.end(), 0xdeadbeef) == 64);
  CHECK(d.padding_untouched());
  if (clearance != nullptr) clearance->assign(d.begin(), d.begin() + count);
  out.resize(n);
  return out;
}

// Looks for contacts inside spheres, most of which are so near the limit that a smaller reach would
// lose some.
struct Hunt {
  int contacts = 0, lost = 0;
  double worst_use =
      -1e9;  // largest (distance at the centre - margin) / reach over spheres with a contact
};

Hunt hunt(const AnalyticField& field, double low, double high, const Reach& reach, float margin,
          std::uint64_t seed) {
  Random random(seed);
  Hunt h;
  for (int i = 0; i < 40000; ++i) {
    // A point on or around the surface: walk along the numerical gradient from a random place.
    double p[3] = {random.uniform(2, 125), random.uniform(2, 133), random.uniform(2, 141)};
    for (int step = 0; step < 3; ++step) {
      const Point at{p[0], p[1], p[2]};
      const double e = 1e-4, d = field.distance(at);
      const double g[3] = {(field.distance({p[0] + e, p[1], p[2]}) - d) / e,
                           (field.distance({p[0], p[1] + e, p[2]}) - d) / e,
                           (field.distance({p[0], p[1], p[2] + e}) - d) / e};
      for (int k = 0; k < 3; ++k) p[k] -= (d - margin) * g[k];
    }
    for (double& v : p) v += random.uniform(-0.3, 0.3);
    const float q[3] = {float(p[0]), float(p[1]), float(p[2])};
    float dq;
    sample_field(field.view(), kIdentity, {&q[0], &q[1], &q[2], 1}, nullptr, 1, &dq, nullptr,
                 nullptr, nullptr);
    if (!(dq <= margin)) continue;
    ++h.contacts;
    // A sphere that just contains it, with its centre as far from the obstacle as a few tries find.
    const double s = random.uniform(low, high);
    float centre[3] = {}, distance = -1e9f;
    for (int t = 0; t < 12; ++t) {
      double n[3];
      random.direction(n);
      float c[3];
      for (int k = 0; k < 3; ++k) c[k] = float(q[k] + s * (1 - 1e-6) * n[k]);
      float d;
      sample_field(field.view(), kIdentity, {&c[0], &c[1], &c[2], 1}, nullptr, 1, &d, nullptr,
                   nullptr, nullptr);
      if (d > distance) distance = d, std::copy(c, c + 3, centre);
    }
    Spheres sphere(1, 0);
    sphere.x[0] = centre[0], sphere.y[0] = centre[1], sphere.z[0] = centre[2];
    sphere.radius[0] = float(s / 4);  // radius_scale 4: another unit
    h.lost += cull(field, sphere, 4.0f, reach, margin, nullptr, 0, 1).empty();
    h.worst_use = std::max(h.worst_use, (double{distance} - margin) / cull_reach(float(s), reach));
  }
  return h;
}

}  // namespace

TEST_CASE("cull_spheres: SIMD agrees with the reference on every target, count and alignment") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      for (const Reach& reach : {Reach{}, wide_reach({}), refined_reach(2.5f)}) {
        Spheres s = random_spheres(n + 9, n % 5, 50 + n);
        Random random(n);
        std::vector<std::uint32_t> rows(n), want(n);
        for (auto& r : rows) r = std::uint32_t(random.below(n + 9));
        for (const std::uint32_t* list : {static_cast<const std::uint32_t*>(nullptr),
                                          static_cast<const std::uint32_t*>(rows.data())}) {
          const std::uint32_t first = list ? 0 : 9;
          want.resize(n);
          want.resize(cull_spheres_ref(field.view(), kIdentity, s.view(), 0.5f, reach, 0.25f, list,
                                       first, n, want.data(), nullptr));
          CHECK(cull(field, s, 0.5f, reach, 0.25f, list, first, n) == want);
          std::vector<float> clearance, wanted(n);
          CHECK(cull(field, s, 0.5f, reach, 0.25f, list, first, n, &clearance) == want);
          std::vector<std::uint32_t> ignored(n + 1);
          cull_spheres_ref(field.view(), kIdentity, s.view(), 0.5f, reach, 0.25f, list, first, n,
                           ignored.data(), wanted.data());
          for (std::size_t k = 0; k < n; ++k)
            CHECK(std::fabs(clearance[k] - wanted[k]) < 1e-3f * (1 + std::fabs(wanted[k])));
        }
      }
    }
  });
}

TEST_CASE("cull_spheres: survivors may overwrite the rows they came from") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Spheres s = random_spheres(333, 1, 9);
    std::vector<std::uint32_t> rows(333);
    for (std::uint32_t i = 0; i < 333; ++i) rows[i] = (i * 101) % 333;
    const auto want = cull(field, s, 1.0f, Reach{}, 0.0f, rows.data(), 0, rows.size());
    const std::size_t n = cull_spheres(field.view(), kIdentity, s.view(), 1.0f, Reach{}, 0.0f,
                                       rows.data(), 0, rows.size(), rows.data(), nullptr);
    rows.resize(n);
    CHECK(rows == want);
    CHECK(n > 20);
    CHECK(n < 333);
  });
}

TEST_CASE("cull_spheres: a point survives exactly when it samples within the margin") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Spheres s = random_spheres(500, 2, 4);
    for (std::size_t i = 0; i < s.count; ++i) s.radius[i] = 0;
    for (float margin : {-2.0f, 0.0f, 0.5f, 7.0f}) {
      std::vector<std::uint32_t> want;
      for (std::uint32_t i = 0; i < s.count; ++i) {
        float d;
        sample_field(field.view(), kIdentity, {s.x.begin(), s.y.begin(), s.z.begin(), s.count}, &i,
                     1, &d, nullptr, nullptr, nullptr);
        if (d <= margin) want.push_back(i);
      }
      CHECK(cull(field, s, 1.0f, Reach{}, margin, nullptr, 0, s.count) == want);
    }
  });
}

TEST_CASE("cull_spheres: no culled sphere holds a point that samples within the margin") {
  const AnalyticField& field = clutter_field();
  const struct {
    double low, high;
    bool wide;
    float margin;
  } cases[] = {
      {1.4, 1.7, false, 0.0f},  {1.595, 1.605, false, 0.5f}, {0.01, 0.5, false, 0.0f},
      {0.5, 1.6, false, 0.25f}, {1.6, 6.0, false, 0.0f},     {6.0, 20.0, false, 0.5f},
      {0.001, 3.0, true, 2.0f},
  };
  std::uint64_t seed = 20;
  for (const auto& c : cases) {
    CAPTURE(c.low);
    CAPTURE(c.high);
    const Hunt h = hunt(field, c.low, c.high, c.wide ? wide_reach({}) : Reach{}, c.margin, ++seed);
    CHECK(h.contacts > 1000);
    CHECK(h.lost == 0);
    CHECK(h.worst_use <= 1.0);
    MESSAGE("radii " << c.low << ".." << c.high << ": " << h.contacts
                     << " contacts, reach used up to " << h.worst_use);
  }
}

TEST_CASE("cull_spheres: what is clearly apart from every obstacle is culled") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Spheres s = random_spheres(2000, 0, 15);
    const auto kept = cull(field, s, 1.0f, Reach{}, 0.0f, nullptr, 0, s.count);
    for (std::uint32_t i : kept) {
      const double d = field.distance({s.x[i], s.y[i], s.z[i]});
      // Bounds are a few voxels low, see field_layout; the rest is the reach.
      CHECK(d <= s.radius[i] + 1.8 + 12.0);
    }
    CHECK(kept.size() < 1400);
  });
}

TEST_CASE("cull_spheres: a sphere that is not finite is culled") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    Spheres s = random_spheres(40, 0, 15);
    for (std::size_t i = 0; i < s.count; ++i) {
      s.radius[i] = 1e6f;
      if (i % 2) s.y[i] = std::numeric_limits<float>::quiet_NaN();
      if (i % 4 == 2) s.radius[i] = std::numeric_limits<float>::quiet_NaN();
    }
    const auto kept = cull(field, s, 1.0f, Reach{}, 0.0f, nullptr, 0, s.count);
    for (std::uint32_t i : kept) CHECK(i % 2 == 0);
    CHECK(kept.size() >= 10);
  });
}

TEST_CASE(
    "cull_spheres: what is clear by some way is culled at any size up to that way, and not much "
    "more") {
  Random random(3);
  for (int i = 0; i < 200000; ++i) {
    const auto distance = float(random.uniform(-1, 20));
    const Reach reach = i % 2 != 0 ? wide_reach({}) : i % 4 != 0 ? refined_reach(2.3f) : Reach{};
    const float clear = cull_clearance(distance, reach);
    if (clear > 0) CHECK(distance > cull_reach(clear * (1 - 1e-6f), reach) - 1e-5f);
    const float more = std::max(clear, 0.0f) + 0.01f;
    // Between its two forms the reach has a step.
    if (more < reach.below - 0.01f || more > reach.below + 0.02f)
      CHECK(distance <= cull_reach(more, reach) + 1e-5f);
  }
}
