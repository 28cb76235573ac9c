// touch_rows_test.cpp - points one by one: which touch, when the others may, which are due.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include "kernels/touch_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/cull_spheres.h"
#include "kernels/expiry.h"
#include "tests/kernels/analytic_field.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

struct Hits {
  std::vector<std::uint32_t> row;
  std::vector<float> d, gx, gy, gz;
  explicit Hits(std::size_t n) : row(n), d(n), gx(n), gy(n), gz(n) {}
  Touching columns() { return {row.data(), d.data(), gx.data(), gy.data(), gz.data()}; }
};

const AnalyticField& clutter_field() {
  static const AnalyticField field(16, 17, 18, clutter);
  return field;
}

std::vector<float> random_places(std::size_t n, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> xyz;
  for (std::size_t i = 0; i < n; ++i)
    for (const double high : {138, 146, 154}) xyz.push_back(float(random.uniform(-10, high)));
  xyz.push_back(0);
  return xyz;
}

}  // namespace

TEST_CASE("touch_rows: SIMD finds the same points and expiries as the reference on every target") {
  const AnalyticField& field = clutter_field();
  on_every_target([&](const std::string&) {
    for (std::size_t count = 0; count <= 67; ++count) {
      std::vector<float> xyz = random_places(2 * count + 1, count);
      if (count > 20) xyz[3 * 14 + 1] = std::numeric_limits<float>::quiet_NaN();
      std::vector<std::uint32_t> rows;
      for (std::uint32_t i = 0; i < count; ++i) rows.push_back(2 * i);
      for (const float limit : {0.0f, 0.5f, 8.0f})
        for (const bool wide : {false, true}) {
          const std::size_t room = (count + 15) / 16 * 16 + 1;
          Hits got(room), want(room);
          std::vector<std::uint16_t> until(2 * count + 1, 7), until_want(until);
          const std::size_t n =
              touch_rows_ref(field.view(), kIdentity, {xyz.data()}, rows.data(), count, limit, wide,
                             100.3f, want.columns(), until_want.data());
          std::copy(rows.begin(), rows.end(), got.row.begin());  // the list itself is written over
          REQUIRE(touch_rows(field.view(), kIdentity, {xyz.data()}, got.row.data(), count, limit,
                             wide, 100.3f, got.columns(), until.data()) == n);
          for (std::size_t i = 0; i < n; ++i) {
            CHECK(got.row[i] == want.row[i]);
            CHECK(std::fabs(got.d[i] - want.d[i]) < 1e-3f);
            CHECK(std::fabs(got.gx[i] - want.gx[i]) + std::fabs(got.gy[i] - want.gy[i]) +
                      std::fabs(got.gz[i] - want.gz[i]) <
                  1e-3f);
          }
          for (std::size_t i = 0; i < until.size(); ++i)
            CHECK(std::abs(int(until[i]) - int(until_want[i])) <= 1);
        }
    }
  });
}

TEST_CASE("touch_rows: a point that moves less than its expiry says does not touch") {
  const AnalyticField& field = clutter_field();
  Random random(3);
  const std::size_t n = 20000;
  std::vector<float> xyz = random_places(n, 11), moved(xyz);
  std::vector<std::uint32_t> rows(n);
  for (std::uint32_t i = 0; i < n; ++i) rows[i] = i;
  std::vector<std::uint16_t> until(n);
  Hits hits(n);
  const float now = 17;
  touch_rows(field.view(), kIdentity, {xyz.data()}, rows.data(), n, 0, false, now, hits.columns(),
             until.data());
  int far = 0;
  for (int direction = 0; direction < 20; ++direction) {
    for (std::size_t i = 0; i < n; ++i) {
      double u[3];
      random.direction(u);
      const float way = until[i] * kPointQuantum - now;
      far += way > 0.1f;
      for (int k = 0; k < 3; ++k)
        moved[3 * i + k] = xyz[3 * i + k] + float(std::max(way, 0.0f) * u[k]);
    }
    std::vector<std::uint16_t> after(n);
    const std::size_t found = touch_rows(field.view(), kIdentity, {moved.data()}, rows.data(), n, 0,
                                         false, now, hits.columns(), after.data());
    for (std::size_t i = 0; i < found; ++i) CHECK(until[hits.row[i]] * kPointQuantum <= now);
  }
  CHECK(far > 100000);
}

TEST_CASE("expiry: SIMD finds the same points and groups on every target, known or not") {
  on_every_target([](const std::string&) {
    Random random(1);
    for (std::size_t points = 0; points <= 333; points += points < 70 ? 1 : 37) {
      const std::size_t groups = (points + 15) / 16;
      // Nothing past the last point is read.
      std::vector<std::uint16_t> value(points), known(groups / 16 + 1);
      for (auto& v : value) v = static_cast<std::uint16_t>(random.below(4) * 256);
      for (auto& v : known) v = static_cast<std::uint16_t>(random.below(65536));
      const PointExpiries view{value.data(), known.data(), points};
      std::vector<std::uint32_t> some;
      for (std::uint32_t g = 0; g < groups; g += 1 + random.below(3)) some.push_back(g);
      for (const float now : {0.0f, 1.0f, 1.999f, 254.9f})
        for (const std::size_t most : {1, 8, 16}) {
          std::vector<std::uint32_t> got(16 * groups + 1, 7), want(got);
          std::size_t n = expired_points_ref(view, some.data(), some.size(), now, want.data());
          CHECK(expired_points(view, some.data(), some.size(), now, got.data()) == n);
          CHECK(std::equal(want.begin(), want.begin() + n, got.begin()));
          n = mostly_expired_points_ref(view, some.data(), some.size(), now, most, want.data());
          CHECK(mostly_expired_points(view, some.data(), some.size(), now, most, got.data()) == n);
          CHECK(std::equal(want.begin(), want.begin() + n, got.begin()));
        }
      std::vector<float> got(groups + 1, -7), want(got);
      least_of_points(view, some.data(), some.size(), got.data());
      least_of_points_ref(view, some.data(), some.size(), want.data());
      CHECK(got == want);
    }
    for (std::size_t blocks = 0; blocks <= 9; ++blocks) {
      std::vector<float> values(16 * blocks + 1);
      for (float& v : values) v = float(random.below(4));
      std::vector<std::uint32_t> some, got(blocks + 1), want(blocks + 1);
      for (std::uint32_t b = 0; b < blocks; b += 1 + random.below(2)) some.push_back(b);
      for (const std::size_t most : {1, 8, 12, 16}) {
        const std::size_t n =
            mostly_expired_ref(values.data(), some.data(), some.size(), 1.5f, most, want.data());
        CHECK(mostly_expired(values.data(), some.data(), some.size(), 1.5f, most, got.data()) == n);
        CHECK(std::equal(want.begin(), want.begin() + n, got.begin()));
      }
    }
  });
}
