// SPDX-License-Identifier: Apache-2.0
// smooth_depths_test.cpp - depths and gradients against quadratic fields, and against the
// reference.
#include "kernels/contact/smooth_depths.h"

#include <cmath>
#include <string>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

constexpr float kVoxel = 1e-3f;
constexpr Affine kHere = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
constexpr Affine kTurned = {{{0, -1, 0, 7}, {1, 0, 0, 3}, {0, 0, 1, -2}}};

struct Rows {
  std::size_t count;
  std::vector<Column> at, place, g;
  Column depth;
  Crosses crosses{{}, 3.0f, {47, 47, 47}, {0, -1, 0, 1, 0, 0, 0, 0, 1}};
  Rows(std::size_t n, std::size_t shift) : count(n), depth(n, shift) {
    Random random(7 + n);
    for (std::size_t k = 0; k < 7; ++k) at.emplace_back(n, shift + k);
    for (std::size_t k = 0; k < 3; ++k) place.emplace_back(n, shift + 2 * k), g.emplace_back(n, k);
    for (std::size_t i = 0; i < n; ++i) {
      double slope[3];
      random.direction(slope);
      const double here = random.uniform(-3, 0.5);
      at[0][i] = float(here);
      for (std::size_t k = 0; k < 3; ++k) {
        const double bend = random.uniform(-0.3, 0.3);
        at[2 * k + 1][i] = float(here + slope[k] + bend / 2);
        at[2 * k + 2][i] = float(here - slope[k] + bend / 2);
        place[k][i] = float(random.uniform(1, 50));
        g[k][i] = float(slope[k]);
      }
      depth[i] = float(random.uniform(-0.1, 1)) * kVoxel;
    }
    for (std::size_t k = 0; k < 7; ++k) crosses.at[k] = at[k].begin();
  }
  template <class Kernel>
  void smooth(Kernel kernel, const Affine& to_field) {
    kernel(crosses, to_field,
           PointsView{place[0].begin(), place[1].begin(), place[2].begin(), count}, kVoxel,
           depth.begin(), g[0].begin(), g[1].begin(), g[2].begin());
  }
};

// A field with second derivatives, sampled at whole numbers, and the point that is looked at.
struct Quadratic {
  double bend[3], slope[3] = {0.48, 0.6, 0.64}, level = -0.4;
  double at(const double* p) const {
    double d = level;
    for (int k = 0; k < 3; ++k)
      d += slope[k] * (p[k] - 20) + bend[k] / 2 * (p[k] - 20) * (p[k] - 20);
    return d;
  }
  double trilinear(const double* p) const {
    double d = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double node[3], share = 1;
      for (int k = 0; k < 3; ++k) {
        const double low = std::floor(p[k]), t = p[k] - low;
        node[k] = low + (corner >> k & 1);
        share *= corner >> k & 1 ? t : 1 - t;
      }
      d += share * at(node);
    }
    return d;
  }
};

struct Answer {
  double before, depth, exact;  // [voxel]
  double tilt_before, tilt;     // of the gradient from the exact one [rad]
  double moved;                 // the gradient, by smoothing [rad]
};
// `band` and `last` are those of the crosses. Where `turned`, the axes of gradients are the
// field's, turned by a right angle about z.
Answer answer(const Quadratic& field, const double p[3], float band = 9, float last = 50,
              bool turned = false) {
  float place[3], at[7], depth, g[3];
  double exact[3], length = 0, trilinear[3], flat = 0;
  at[0] = float(field.trilinear(p));
  for (int k = 0; k < 3; ++k) {
    double low[3] = {p[0], p[1], p[2]}, high[3] = {p[0], p[1], p[2]};
    low[k] -= 1, high[k] += 1;
    at[2 * k + 1] = float(field.trilinear(high)), at[2 * k + 2] = float(field.trilinear(low));
    place[k] = float(p[k]);
    exact[k] = field.slope[k] + field.bend[k] * (p[k] - 20);
    low[k] = std::floor(p[k]), high[k] = low[k] + 1;
    trilinear[k] = field.trilinear(high) - field.trilinear(low);
    length += exact[k] * exact[k], flat += trilinear[k] * trilinear[k];
  }
  length = std::sqrt(length), flat = std::sqrt(flat);
  for (int k = 0; k < 3; ++k) g[k] = float(trilinear[k] / flat);
  if (turned) std::swap(g[0], g[1]), g[0] = -g[0];
  Crosses crosses{{}, band, {last, last, last}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  if (turned) crosses = {{}, band, {last, last, last}, {0, -1, 0, 1, 0, 0, 0, 0, 1}};
  for (int k = 0; k < 7; ++k) crosses.at[k] = at + k;
  depth = -at[0];  // of voxels of 1 m
  const auto angle = [&](const auto* v, double over) {
    double cross = 0;
    for (int k = 0; k < 3; ++k) {
      const int a = (k + 1) % 3, b = (k + 2) % 3;
      const double part = (v[a] * exact[b] - v[b] * exact[a]) / (over * length);
      cross += part * part;
    }
    return std::sqrt(cross);
  };
  Answer out{-at[0], 0, -field.at(p), angle(trilinear, flat), 0, 0};
  smooth_depths_ref(crosses, kHere, {place, place + 1, place + 2, 1}, 1, &depth, g, g + 1, g + 2);
  if (turned) std::swap(g[0], g[1]), g[1] = -g[1];
  out.depth = depth, out.tilt = angle(g, 1);
  double same = 0;
  for (int k = 0; k < 3; ++k) same += g[k] * trilinear[k] / flat;
  out.moved = std::acos(std::min(same, 1.0));
  return out;
}

}  // namespace

TEST_CASE("smooth_depths: every target agrees with the reference") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n)
      for (const Affine& to_field : {kHere, kTurned}) {
        Rows got(n, n % 5), want(n, 0);
        got.smooth(smooth_depths, to_field);
        want.smooth(smooth_depths_ref, to_field);
        for (std::size_t i = 0; i < n; ++i) {
          CHECK(std::fabs(got.depth[i] - want.depth[i]) < 1e-5f * kVoxel);
          double length2 = 0;
          for (std::size_t k = 0; k < 3; ++k) {
            CHECK(std::fabs(got.g[k][i] - want.g[k][i]) < 1e-5f);
            length2 += double{got.g[k][i]} * got.g[k][i];
          }
          CHECK(std::fabs(length2 - 1) < 1e-5);
        }
        CHECK(got.depth.padding_untouched());
        for (Column& column : got.g) CHECK(column.padding_untouched());
      }
  });
}

TEST_CASE("smooth_depths: on a gently curved field depth and gradient are nearly exact") {
  Random random(11);
  double before = 0, after = 0, tilt_before = 0, tilt = 0;
  for (int i = 0; i < 1000; ++i) {
    const Quadratic field{{0.05, -0.04, 0.03}};
    double p[3];
    for (double& x : p) x = float(random.uniform(19.7, 20.3));
    const Answer a = answer(field, p, 9, 50, i % 2);
    if (a.before < 0.1) continue;
    before = std::max(before, std::fabs(a.before - a.exact));
    after = std::max(after, std::fabs(a.depth - a.exact));
    tilt_before = std::max(tilt_before, a.tilt_before), tilt = std::max(tilt, a.tilt);
  }
  CHECK(before > 0.005);
  CHECK(after < before / 10);
  CHECK(tilt_before > 0.02);
  CHECK(tilt < tilt_before / 10);
}

TEST_CASE("smooth_depths: planes, sharp fields and points that do not touch keep their depths") {
  const double middle[3] = {19.5, 20.5, 20.5};
  const Answer plane = answer({{0, 0, 0}}, middle), sharp = answer({{0.3, 0.3, 0}}, middle);
  CHECK(std::fabs(plane.depth - plane.before) < 1e-6);
  CHECK(plane.tilt < 1e-6);
  CHECK(sharp.depth == sharp.before);
  for (double level = 0.5; level < 2; level += 0.1) {
    const Answer outside = answer({{0.1, 0.1, 0}, {0.48, 0.6, 0.64}, level}, middle);
    CHECK(outside.before < 0);
    CHECK(outside.depth == outside.before);
  }
}

TEST_CASE(
    "smooth_depths: a gradient from the cell beside the contact's becomes exact all the same") {
  // A contact on a node of a cylinder that is aligned with the lattice, as rounding gives it.
  const float place[3] = {20, 20, 20}, at[7] = {-0.4f, -0.35f, -0.35f, -0.4f, -0.4f, 0.6f, -1.4f};
  Crosses crosses{{}, 9, {50, 50, 50}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (int k = 0; k < 7; ++k) crosses.at[k] = at + k;
  for (const float side : {-1.0f, 1.0f}) {
    float depth = 0.4f, g[3] = {side * 0.05f, 0, std::sqrt(1 - 0.05f * 0.05f)};
    smooth_depths_ref(crosses, kHere, {place, place + 1, place + 2, 1}, 1, &depth, g, g + 1, g + 2);
    CHECK(std::fabs(depth - 0.4f) < 1e-6);
    CHECK(std::fabs(g[0]) < 0.05f * 0.05f);
    CHECK(g[2] > 0.99999f);
  }
}

TEST_CASE("smooth_depths: nothing moves where a distance of the cross may be no distance") {
  const Quadratic field{{0.1, 0.1, 0}};
  const double inside[3] = {19.2, 20.75, 20.5};
  CHECK(answer(field, inside).moved > 1e-3);
  const double reach = -answer(field, inside).before;
  // The band ends, or the grid does.
  const float ends = float(std::fabs(reach) + 1);
  for (const float band : {ends, ends - 0.1f, 0.5f}) {
    const Answer a = answer(field, inside, band);
    CHECK(a.depth == a.before);
    CHECK(a.moved < 1e-3);
  }
  CHECK(answer(field, inside, ends + 0.2f).moved > 1e-3);
  for (const float last : {21.75f, 21.5f}) CHECK(answer(field, inside, 9, last).moved < 1e-3);
  CHECK(answer(field, inside, 9, 22).moved > 1e-3);
}

TEST_CASE("smooth_depths: where a field is no distance and its slope ends, the gradient stays") {
  const float place[3] = {20.5f, 20.5f, 20.5f},
              at[7] = {-0.4f, -0.4f, -0.4f, -0.4f, -0.4f, -0.4f, -0.4f};
  Crosses crosses{{}, 9, {50, 50, 50}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  for (int k = 0; k < 7; ++k) crosses.at[k] = at + k;
  float depth = 0.4f, g[3] = {0.6f, 0, 0.8f};
  smooth_depths_ref(crosses, kHere, {place, place + 1, place + 2, 1}, 1, &depth, g, g + 1, g + 2);
  CHECK(std::fabs(g[0] - 0.6f) < 1e-6);
  CHECK(std::fabs(g[2] - 0.8f) < 1e-6);
}

TEST_CASE("smooth_depths: a depth moves by less than a fortieth of a voxel, without jumps") {
  for (double level = -1; level < 0.2; level += 0.05)
    for (double bend = -0.6; bend < 0.6; bend += 0.05) {
      double last = 0;
      for (double x = 18.5; x < 21.5; x += 0.01) {
        const double p[3] = {x, 20.5, 20.25};
        const Answer a = answer({{bend, bend / 2, 0}, {0.48, 0.6, 0.64}, level}, p);
        const double moved = a.depth - a.before;
        CHECK(std::fabs(moved) < 0.025);
        if (x > 18.5) CHECK(std::fabs(moved - last) < 0.006);
        last = moved;
      }
    }
}
