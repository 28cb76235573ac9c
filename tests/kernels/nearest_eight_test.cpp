// One point against eight boxes and triangles: never more than the truth, and hardly less.
#include <doctest/doctest.h>

#include <hwy/targets.h>

#include <cmath>
#include <cstdint>
#include <random>

#include "kernels/nearest_eight.h"

using namespace h6::kernels;

namespace {

struct Random {
  std::mt19937_64 engine{5};
  float operator()(double low, double high) {
    return float(low + (high - low) * double(engine() >> 11) * 0x1p-53);
  }
};

template <class F>
void on_every_target(F&& check) {
  for (std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    INFO("target " << hwy::TargetName(target));
    check();
  }
  hwy::SetSupportedTargetsForTest(0);
}

}  // namespace

TEST_CASE("eight_boxes: a lower bound, tight to a millionth") {
  on_every_target([] {
    Random random;
    for (int i = 0; i < 300; ++i) {
      EightBoxes boxes;
      for (int k = 0; k < 3; ++k)
        for (int b = 0; b < 8; ++b) {
          boxes.low[k][b] = random(-1000, 1000);
          boxes.high[k][b] = boxes.low[k][b] + random(0, 100);
        }
      const float p[3] = {random(-1000, 1000), random(-1000, 1000), random(-1000, 1000)};
      float fast[8], exact[8];
      const std::uint32_t below = eight_boxes(boxes, p, 1e5f, fast);
      eight_boxes_ref(boxes, p, exact);
      for (int b = 0; b < 8; ++b) {
        CHECK(fast[b] <= exact[b]);
        CHECK(fast[b] >= exact[b] * (1 - 4e-6f));
        CHECK((below >> b & 1) == (fast[b] < 1e5f));
      }
    }
  });
}

TEST_CASE("eight_turned_boxes: a lower bound but for rounding along the axes, tight to as much") {
  on_every_target([] {
    Random random;
    std::size_t wrong = 0;
    for (int i = 0; i < 3000; ++i) {
      EightTurnedBoxes boxes;
      for (int b = 0; b < 8; ++b) {
        const double s = random(0, 6.28), t = random(0, 6.28);
        const double axis[3][3] = {
            {std::cos(s) * std::cos(t), std::sin(s) * std::cos(t), std::sin(t)},
            {-std::sin(s), std::cos(s), 0},
            {-std::cos(s) * std::sin(t), -std::sin(s) * std::sin(t), std::cos(t)}};
        for (int k = 0; k < 3; ++k) {
          for (int c = 0; c < 3; ++c) boxes.axis[k][c][b] = float(axis[k][c]);
          boxes.middle[k][b] = random(-1000, 1000);
          boxes.half[k][b] = random(0, 300);
        }
      }
      const float p[3] = {random(-1000, 1000), random(-1000, 1000), random(-1000, 1000)};
      float fast[8], exact[8];
      const std::uint32_t below = eight_turned_boxes(boxes, p, 1e5f, fast);
      eight_turned_boxes_ref(boxes, p, exact);
      for (int b = 0; b < 8; ++b) {
        const double d = std::sqrt(double(exact[b])), rounding = 4e-4;
        wrong += std::sqrt(double(fast[b])) > d + rounding;
        wrong += std::sqrt(double(fast[b])) < d * (1 - 4e-6) - rounding;
        wrong += (below >> b & 1) != (fast[b] < 1e5f);
      }
      boxes.half[0][0] = -1;
      boxes.middle[0][0] = boxes.middle[1][0] = boxes.middle[2][0] = 1e9f;  // empty: far away
      eight_turned_boxes(boxes, p, 1e5f, fast);
      wrong += fast[0] < 1e12f;
    }
    CHECK(wrong == 0);
  });
}

TEST_CASE("eight_triangles: a lower bound, tight where triangles are neither huge nor slivers") {
  on_every_target([] {
    Random random;
    std::size_t too_long = 0, loose = 0, loose_slivers = 0, slivers = 0;
    for (int i = 0; i < 4000; ++i) {
      EightTriangles t;
      const double size = i % 4 == 0 ? 800.0 : i % 4 == 1 ? 0.5 : 10.0;
      const bool sliver = i % 3 == 0;
      for (int b = 0; b < 8; ++b) {
        const float along = random(-0.5, 1.5);
        for (int k = 0; k < 3; ++k) {
          t.a[k][b] = random(-1000, 1000);
          t.ab[k][b] = random(-size, size);
          t.ac[k][b] = sliver ? along * t.ab[k][b] + random(-1e-3 * size, 1e-3 * size)
                              : random(-size, size);
        }
      }
      const int near = int(random(0, 7.99));
      const float p[3] = {t.a[0][near] + random(-40, 40), t.a[1][near] + random(-40, 40),
                          t.a[2][near] + random(-40, 40)};
      float fast[8], exact[8];
      const std::uint32_t below = eight_triangles(t, p, 900, fast);
      eight_triangles_ref(t, p, exact);
      for (int b = 0; b < 8; ++b) {
        too_long += fast[b] > exact[b] || (below >> b & 1) != (fast[b] < 900);
        const bool low = std::sqrt(fast[b]) < std::sqrt(exact[b]) * 0.9995f - 0.05f;
        loose += size < 100 && !sliver && low;
        loose_slivers += sliver && low;
        slivers += sliver;
      }
    }
    CHECK(too_long == 0);
    CHECK(loose < 300);  // of 18,000: random triangles are slivers now and then
    CHECK(loose_slivers < slivers / 50);
  });
}

TEST_CASE("eight_triangles: a lower bound over long triangles, far from their first corner") {
  on_every_target([] {
    Random random;
    std::size_t too_long = 0, loose = 0, all = 0;
    for (int i = 0; i < 4000; ++i) {
      // A long right triangle, turned; the point is over it, at the far end.
      const double length = random(50, 900), width = length * random(0.01, 0.2);
      const double turn = i % 2 == 0 ? 0 : random(0, 3), height = random(2, 30);
      const double along[3] = {std::cos(turn), std::sin(turn), 0};
      const double aside[3] = {-0.6 * std::sin(turn), 0.6 * std::cos(turn), 0.8};
      const double up[3] = {0.8 * std::sin(turn), -0.8 * std::cos(turn), 0.6};
      EightTriangles t;
      float p[3];
      const double at = random(0.7, 0.99), off = random(0.01, 0.6);
      for (int k = 0; k < 3; ++k) {
        const float a = random(-300, 300);
        for (int b = 0; b < 8; ++b) {
          t.a[k][b] = a;
          t.ab[k][b] = float(length * along[k]);
          t.ac[k][b] = float(length * along[k] + width * aside[k]);
        }
        p[k] = float(a + at * length * along[k] + off * width * aside[k] + height * up[k]);
      }
      float fast[8], exact[8];
      eight_triangles(t, p, 1e9f, fast);
      eight_triangles_ref(t, p, exact);
      too_long += fast[0] > exact[0] * (1 + 1e-6f);
      loose += width > 0.05 * length && std::sqrt(fast[0]) < std::sqrt(exact[0]) - 0.3f;
      all += 1;
    }
    CHECK(too_long == 0);
    CHECK(loose < all / 50);
  });
}
