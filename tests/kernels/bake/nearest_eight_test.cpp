// SPDX-License-Identifier: Apache-2.0
// One point against eight boxes and triangles: the bounds are never above the distance, and tight.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "kernels/bake/nearest_eight.h"
#include "kernels/bake/triangle_distance.h"
#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;

namespace {

struct Random {
  std::mt19937_64 engine{5};
  float operator()(double low, double high) {
    return float(low + (high - low) * double(engine() >> 11) * 0x1p-53);
  }
};

}  // namespace

TEST_CASE("eight_boxes: a lower bound, tight to a millionth") {
  on_every_target([](const std::string&) {
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
  on_every_target([](const std::string&) {
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
  on_every_target([](const std::string&) {
    Random random;
    std::size_t too_long = 0, loose = 0, loose_slivers = 0, slivers = 0;
    for (int i = 0; i < 4000; ++i) {
      EightTriangles t;
      double corner[8][3][3];
      const double size = i % 4 == 0 ? 800.0 : i % 4 == 1 ? 0.5 : 10.0;
      const bool sliver = i % 3 == 0;
      for (int b = 0; b < 8; ++b) {
        const float along = random(-0.5, 1.5);
        for (int k = 0; k < 3; ++k) {
          const float a = random(-1000, 1000), ab = random(-size, size);
          corner[b][0][k] = a;
          corner[b][1][k] = a + ab;
          corner[b][2][k] =
              a + (sliver ? along * ab + random(-1e-3 * size, 1e-3 * size) : random(-size, size));
        }
        set_triangle(t, std::size_t(b), corner[b][0], corner[b][1], corner[b][2]);
      }
      const int near = int(random(0, 7.99));
      const float p[3] = {float(corner[near][0][0]) + random(-40, 40),
                          float(corner[near][0][1]) + random(-40, 40),
                          float(corner[near][0][2]) + random(-40, 40)};
      float fast[8], exact[8];
      const std::uint32_t below = eight_triangles(t, p, 900, fast);
      eight_triangles_ref(corner[0][0], p, exact);
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
  on_every_target([](const std::string&) {
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
      double corner[8][3][3];
      float p[3];
      const double at = random(0.7, 0.99), off = random(0.01, 0.6);
      for (int k = 0; k < 3; ++k) {
        const float a = random(-300, 300);
        for (int b = 0; b < 8; ++b) {
          corner[b][0][k] = a;
          corner[b][1][k] = a + length * along[k];
          corner[b][2][k] = a + length * along[k] + width * aside[k];
        }
        p[k] = float(a + at * length * along[k] + off * width * aside[k] + height * up[k]);
      }
      for (std::size_t b = 0; b < 8; ++b)
        set_triangle(t, b, corner[b][0], corner[b][1], corner[b][2]);
      float fast[8], exact[8];
      eight_triangles(t, p, 1e9f, fast);
      eight_triangles_ref(corner[0][0], p, exact);
      too_long += fast[0] > exact[0] * (1 + 1e-6f);
      loose += width > 0.05 * length && std::sqrt(fast[0]) < std::sqrt(exact[0]) - 0.3f;
      all += 1;
    }
    CHECK(too_long == 0);
    CHECK(loose < all / 40);
  });
}

TEST_CASE(
    "set_leaf: the triangles and boxes of the specification, flat ones and slivers too, on "
    "every target") {
  on_every_target([](const std::string&) {
    Random random;
    std::size_t far_off = 0, outside = 0, larger = 0, touched = 0;
    for (int i = 0; i < 2000; ++i) {
      // A patch of a slanted plane, more or less; flat triangles, points and slivers among it.
      LeafCorners corners;
      const double size = i % 4 == 0 ? 300 : i % 4 == 1 ? 0.3 : 6, rough = i % 3 == 0 ? 1 : 0.02;
      double at[3], along[2][3];
      for (int k = 0; k < 3; ++k) {
        at[k] = random(-700, 700);
        for (auto& axis : along) axis[k] = random(-1, 1);
      }
      for (std::size_t t = 0; t < 8; ++t)
        for (std::size_t v = 0; v < 3; ++v) {
          const double s = random(-size, size), u = random(-size, size);
          for (std::size_t k = 0; k < 3; ++k)
            corners.at[v][k][t] =
                at[k] + s * along[0][k] + u * along[1][k] + rough * random(-size, size);
        }
      const auto same = [&](std::size_t to, std::size_t from, std::size_t t, double off) {
        for (std::size_t k = 0; k < 3; ++k)
          corners.at[to][k][t] = corners.at[from][k][t] + off * (k == 1);
      };
      same(1, 0, 2, 0);
      if (i % 2 == 0) same(2, 0, 2, 0);
      same(2, 1, 5, 1e-3);
      const std::size_t box = std::size_t(i % 8);
      EightTriangles fast{}, exact{};
      EightTurnedBoxes fast_turned{}, exact_turned{};
      EightBoxes fast_boxes{}, exact_boxes{};
      set_leaf(corners, fast, fast_turned, fast_boxes, box);
      set_leaf_ref(corners, exact, exact_turned, exact_boxes, box);
      for (int q = 0; q < 8; ++q) {
        float p[3], near_fast[8], near_exact[8];
        for (int k = 0; k < 3; ++k) p[k] = float(at[k]) + random(-2 * size - 20, 2 * size + 20);
        eight_triangles(fast, p, 1e9f, near_fast);
        eight_triangles(exact, p, 1e9f, near_exact);
        for (std::size_t t = 0; t < 8; ++t)
          far_off += std::fabs(std::sqrt(near_fast[t]) - std::sqrt(near_exact[t])) >
                     1e-3 + 1e-5 * std::sqrt(near_exact[t]);
      }
      double volume[2] = {1, 1};
      for (std::size_t k = 0; k < 3; ++k) {
        far_off += std::fabs(fast_boxes.low[k][box] - exact_boxes.low[k][box]) > 1e-4f;
        far_off += std::fabs(fast_boxes.high[k][box] - exact_boxes.high[k][box]) > 1e-4f;
        volume[0] *= 2 * double(fast_turned.half[k][box]) + 1;
        volume[1] *= 2 * double(exact_turned.half[k][box]) + 1;
        touched += fast_turned.half[k][(box + 1) % 8] != 0 || fast_boxes.low[k][(box + 1) % 8] != 0;
        for (std::size_t t = 0; t < 8; ++t)
          for (std::size_t v = 0; v < 3; ++v) {
            double turned = -double(fast_turned.middle[k][box]);
            for (std::size_t c = 0; c < 3; ++c)
              turned += double(fast_turned.axis[k][c][box]) * corners.at[v][c][t];
            outside += std::fabs(turned) > double(fast_turned.half[k][box]) - 4e-4;
            outside += corners.at[v][k][t] < double(fast_boxes.low[k][box]) ||
                       corners.at[v][k][t] > double(fast_boxes.high[k][box]);
          }
      }
      // The mean plane is not the same where normals turn against each other.
      larger += rough < 1 && volume[0] > 1.05 * volume[1] + 0.1;
    }
    CHECK(far_off == 0);
    CHECK(outside == 0);
    CHECK(larger < 20);
    CHECK(touched == 0);
  });
}

TEST_CASE("nearest_search: what looking at every triangle finds, from any start, on every target") {
  constexpr std::uint32_t kTriangles = 8 * 8 * 9 - 3;  // not a whole number of leaves
  constexpr std::size_t kLeaves = (kTriangles + 7) / 8, kNodes = (kLeaves + 7) / 8;
  Random random;
  std::vector<EightTriangles> leaf(kLeaves);
  std::vector<EightTurnedBoxes> around(kNodes);
  std::vector<EightBoxes> boxes(kNodes), top(1);
  const auto empty = [](EightBoxes& b) {
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 8; ++i) b.low[k][i] = 1e9f, b.high[k][i] = -1e9f;
  };
  for (EightBoxes& b : boxes) empty(b);
  empty(top[0]);
  const auto widen = [](EightBoxes& b, std::size_t i, int k, double low, double high) {
    b.low[k][i] = std::min(b.low[k][i], float(low - 1e-3));
    b.high[k][i] = std::max(b.high[k][i], float(high + 1e-3));
  };
  std::vector<std::array<double, 9>> corners(8 * kLeaves);
  for (std::size_t l = 0; l < 8 * kNodes; ++l) {
    EightTurnedBoxes& b = around[l / 8];
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) b.axis[k][c][l % 8] = k == c;
      b.middle[k][l % 8] = 1e9f;
      b.half[k][l % 8] = -1;
    }
    if (l >= kLeaves) continue;
    const double at[3] = {random(-100, 100), random(-100, 100), random(-100, 100)};
    double low[3] = {1e9, 1e9, 1e9}, high[3] = {-1e9, -1e9, -1e9};
    for (std::size_t i = 0; i < 8; ++i) {
      double* c = corners[8 * l + i].data();
      for (int v = 0; v < 9; ++v) {
        c[v] = at[v % 3] + random(-4, 4);
        low[v % 3] = std::min(low[v % 3], c[v]);
        high[v % 3] = std::max(high[v % 3], c[v]);
      }
      set_triangle(leaf[l], i, c, c + 3, c + 6);
    }
    for (int k = 0; k < 3; ++k) {
      b.middle[k][l % 8] = float((low[k] + high[k]) / 2);
      b.half[k][l % 8] = float((high[k] - low[k]) / 2 + 1e-3);
      widen(boxes[l / 64], l / 8 % 8, k, low[k], high[k]);
      widen(top[0], l / 64, k, low[k], high[k]);
    }
  }
  NearestTree tree;
  tree.leaf = leaf.data();
  tree.around_leaf = around.data();
  tree.level[1] = boxes.data();
  tree.level[2] = top.data();
  tree.levels = 3;
  tree.triangles = kTriangles;
  on_every_target([&](const std::string&) {
    for (int i = 0; i < 300; ++i) {
      const double spread = i % 2 == 0 ? 120.0 : 400.0;
      const float p[3] = {random(-spread, spread), random(-spread, spread),
                          random(-spread, spread)};
      NearestFound all{1e12f, 0, 0}, found{1e12f, 0, 0}, nothing{1e-3f, 7, 0};
      nearest_search_ref(tree, p, &all);
      const std::uint32_t start[3] = {std::uint32_t(random(0, kLeaves - 1)), all.place / 8, 0};
      nearest_search(tree, p, start, std::size_t(i % 4), -1, &found);
      CHECK(found.squared == all.squared);
      const double* c = corners[found.place].data();
      const double at[3] = {p[0], p[1], p[2]};
      const double exact = point_triangle_squared(at, c, c + 3, c + 6);
      CHECK(std::sqrt(exact) >= std::sqrt(double(found.squared)) - 1e-4);
      CHECK(std::sqrt(exact) <= std::sqrt(double(found.above)) + 1e-4);
      nearest_search(tree, p, nullptr, 0, -1, &nothing);
      CHECK((nothing.place == 7) == (all.squared >= 1e-3f));
      // A search stops at the first leaf if that is near enough; else it finds the nearest of all.
      NearestFound first{1e12f, 0, 0}, content{1e12f, 0, 0}, never{1e12f, 0, 0};
      nearest_search(tree, p, start, 1, 1e11f, &first);
      CHECK(first.place / 8 == start[0]);
      nearest_search(tree, p, start, 1, first.squared, &content);
      CHECK(content.squared == first.squared);
      nearest_search(tree, p, start, 1, 0.999f * all.squared - 1e-6f, &never);
      CHECK(never.squared == all.squared);
    }
  });
}
