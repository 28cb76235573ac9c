// SPDX-License-Identifier: Apache-2.0
// gauss_tree_sort.cpp - contacts in the order of a space-filling curve over the Gauss map.
//
// The octahedral map lays directions flat, one face to a quadrant: near directions stay near,
// except across the edges of the lower half. The axis nearest to the mean direction points up. The
// order decides how tight leaves are, never a sum: approximations here cost time only.
#include <algorithm>
#include <cmath>

#include "kernels/weights/gauss_tree_stages.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/weights/gauss_tree_sort.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/tail-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

using DF = hn::ScalableTag<float>;
using DU = hn::RebindToUnsigned<DF>;
using VF = hn::Vec<DF>;
using VU = hn::Vec<DU>;

// Flat coordinates of one sphere's vectors, the box around them, and how far the square of a length
// is from 1, at most.
struct Flat {
  float *u, *v;
  float low[2], extent, uneven;
};

struct Up {
  int axis;
  float sign;
};

HWY_INLINE Up up_of(const float* const* column, std::size_t count) {
  const DF d;
  Up up{2, 1.0f};
  float most = -1;
  for (int k = 0; k < 3; ++k) {
    VF sum = hn::Zero(d);
    for (std::size_t i = 0; i < count; i += hn::Lanes(d))
      sum = hn::Add(sum, load_n(d, column[k] + i, count - i));
    const float total = hn::GetLane(hn::SumOfLanes(d, sum));
    if (!(std::fabs(total) > most)) continue;
    most = std::fabs(total);
    up = {k, total < 0 ? -1.0f : 1.0f};
  }
  return up;
}

HWY_INLINE void flatten(const float* const* column, std::size_t count, Flat& flat) {
  const DF d;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  const Up up = up_of(column, count);
  const float *const px = column[(up.axis + 1) % 3], *const py = column[(up.axis + 2) % 3];
  const float* const pz = column[up.axis];
  VF low[2] = {one, one}, high[2] = {hn::Neg(one), hn::Neg(one)}, uneven = zero;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const std::size_t live = count - i;
    const VF x = load_n(d, px + i, live), y = load_n(d, py + i, live);
    const VF z = hn::Mul(load_n(d, pz + i, live), hn::Set(d, up.sign));
    const VF size = hn::Add(hn::Abs(x), hn::Add(hn::Abs(y), hn::Abs(z)));
    const VF scale = hn::Div(one, hn::Max(size, hn::Set(d, 1e-30f)));
    VF u = hn::Mul(x, scale), v = hn::Mul(y, scale);
    const VF folded_u = hn::CopySign(hn::Sub(one, hn::Abs(v)), u);
    const VF folded_v = hn::CopySign(hn::Sub(one, hn::Abs(u)), v);
    const auto below = hn::Lt(z, zero);
    u = hn::IfThenElse(below, folded_u, u);
    v = hn::IfThenElse(below, folded_v, v);
    hn::Store(u, d, flat.u + i);
    hn::Store(v, d, flat.v + i);
    const auto real = hn::FirstN(d, live);
    low[0] = hn::Min(low[0], hn::IfThenElse(real, u, one));
    low[1] = hn::Min(low[1], hn::IfThenElse(real, v, one));
    high[0] = hn::Max(high[0], hn::IfThenElse(real, u, hn::Neg(one)));
    high[1] = hn::Max(high[1], hn::IfThenElse(real, v, hn::Neg(one)));
    const VF square = hn::MulAdd(z, z, hn::MulAdd(y, y, hn::Mul(x, x)));
    uneven = hn::Max(uneven, hn::IfThenElseZero(real, hn::Abs(hn::Sub(square, one))));
  }
  flat.uneven = hn::GetLane(hn::MaxOfLanes(d, uneven));
  flat.extent = 0;
  for (int k = 0; k < 2; ++k) {
    flat.low[k] = hn::GetLane(hn::MinOfLanes(d, low[k]));
    flat.extent = HWY_MAX(flat.extent, hn::GetLane(hn::MaxOfLanes(d, high[k])) - flat.low[k]);
  }
}

// For x below 2^16: moves its bits to the even places.
HWY_INLINE VU spread(VU x) {
  const DU d;
  x = hn::And(hn::Or(x, hn::ShiftLeft<8>(x)), hn::Set(d, 0x00ff00ffu));
  x = hn::And(hn::Or(x, hn::ShiftLeft<4>(x)), hn::Set(d, 0x0f0f0f0fu));
  x = hn::And(hn::Or(x, hn::ShiftLeft<2>(x)), hn::Set(d, 0x33333333u));
  return hn::And(hn::Or(x, hn::ShiftLeft<1>(x)), hn::Set(d, 0x55555555u));
}

HWY_INLINE VU interleave(VU x, VU y) { return hn::Or(spread(x), hn::ShiftLeft<1>(spread(y))); }

// For x below 2^16: moves its pairs of bits to every other pair of places.
HWY_INLINE VU spread_pairs(VU x) {
  const DU d;
  x = hn::And(hn::Or(x, hn::ShiftLeft<8>(x)), hn::Set(d, 0x00ff00ffu));
  x = hn::And(hn::Or(x, hn::ShiftLeft<4>(x)), hn::Set(d, 0x0f0f0f0fu));
  return hn::And(hn::Or(x, hn::ShiftLeft<2>(x)), hn::Set(d, 0x33333333u));
}

HWY_INLINE VU cell(const float* column, float low, float scale, int bits) {
  const DF d;
  const VF at = hn::Mul(hn::Sub(hn::LoadU(d, column), hn::Set(d, low)), hn::Set(d, scale));
  const hn::RebindToSigned<DF> di;
  // The key is in range for a NaN too.
  return hn::And(hn::BitCast(DU(), hn::ConvertTo(di, at)), hn::Set(DU(), (1u << bits) - 1));
}

HWY_INLINE float cells_per_unit(float extent, int bits) {
  return extent > 0 ? (static_cast<float>(1u << bits) - 1) / extent : 0.0f;
}

// Place on Hilbert's curve through 2^bits x 2^bits cells.
HWY_INLINE VU hilbert(VU x, VU y, int bits) {
  const DU d;
  const VU all = hn::Set(d, (1u << bits) - 1), zero = hn::Zero(d);
  VU place = zero;
  for (int k = bits - 1; k >= 0; --k) {
    const VU bit = hn::Set(d, 1u << k);
    const auto right = hn::Ne(hn::And(x, bit), zero), upper = hn::Ne(hn::And(y, bit), zero);
    const VU quarter = hn::Xor(hn::IfThenElseZero(right, hn::Set(d, 3u)),
                               hn::IfThenElseZero(upper, hn::Set(d, 1u)));
    place = hn::Or(hn::ShiftLeft<2>(place), quarter);
    const VU flip = hn::IfThenElseZero(hn::AndNot(upper, right), all);
    const VU a = hn::Xor(x, flip), b = hn::Xor(y, flip);
    x = hn::IfThenElse(upper, a, b);
    y = hn::IfThenElse(upper, b, a);
  }
  return place;
}

// Returns the bits of a key.
HWY_INLINE int keys_of_sphere(const GaussDensity& g, std::size_t count, int budget) {
  const DU d;
  const std::size_t rows = g.level[0].count * kGaussLeaf;  // the leaves are not filled yet
  Flat flat{g.leaves, g.leaves + rows, {}, 0, 0};
  flatten(g.column, count, flat);
  *g.uneven = flat.uneven;
  const int bits = budget / 2;
  const float scale = cells_per_unit(flat.extent, bits);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VU u = cell(flat.u + i, flat.low[0], scale, bits);
    const VU v = cell(flat.v + i, flat.low[1], scale, bits);
    hn::Store(hilbert(u, v, bits), d, g.key + i);
  }
  return 2 * bits;
}

// The bits of an axis for which its cells are at most `cell` widths wide.
HWY_INLINE int bits_to(float extent, float width, float cell, int most) {
  int bits = 0;
  for (float size = extent / width; size > cell && bits < most; size *= 0.5f) ++bits;
  return bits;
}

// Keys have N first, down to cells that one support covers, then T down to an eighth of its width,
// then both by turns. Contacts on a wall share one cell of N, and their torque directions lie on a
// circle: there an order by T alone makes the tightest leaves.
HWY_INLINE int keys_of_product(const GaussDensity& g, std::size_t count, int budget) {
  const DU d;
  const std::size_t rows = g.level[0].count * kGaussLeaf;  // the leaves are not filled yet
  Flat flat[2] = {{g.leaves, g.leaves + rows, {}, 0, 0},
                  {g.leaves + 2 * rows, g.leaves + 3 * rows, {}, 0, 0}};
  for (int s = 0; s < 2; ++s) flatten(g.column + 3 * s, count, flat[s]);
  const int first = bits_to(flat[0].extent, g.width[0], 2.0f, 6);
  const int second = bits_to(flat[1].extent, g.width[1], 0.03125f, HWY_MIN(8, budget / 2 - first));
  const int both = HWY_MAX(0, (budget / 2 - first - second) / 2);
  const int bits[2] = {first + both, second + both};
  float scale[2];
  for (int s = 0; s < 2; ++s) scale[s] = cells_per_unit(flat[s].extent, bits[s]);
  const VU lowest = hn::Set(d, (1u << both) - 1);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    VU low[2], high[2];
    for (int s = 0; s < 2; ++s) {
      const VU u = cell(flat[s].u + i, flat[s].low[0], scale[s], bits[s]);
      const VU v = cell(flat[s].v + i, flat[s].low[1], scale[s], bits[s]);
      low[s] = spread_pairs(interleave(hn::And(u, lowest), hn::And(v, lowest)));
      high[s] = hilbert(hn::ShiftRightSame(u, both), hn::ShiftRightSame(v, both), bits[s] - both);
    }
    const VU turns = hn::Or(low[1], hn::ShiftLeft<2>(low[0]));
    const VU ahead = hn::Or(hn::ShiftLeftSame(high[0], 2 * second), high[1]);
    hn::Store(hn::Or(hn::ShiftLeftSame(ahead, 4 * both), turns), d, g.key + i);
  }
  return 2 * (bits[0] + bits[1]);
}

int gauss_keys(const GaussDensity& g, std::size_t count, int budget) {
  return g.axes == 3 ? keys_of_sphere(g, count, budget) : keys_of_product(g, count, budget);
}

float largest_share(const DirectionsView& c) {
  const DF d;
  VF most = hn::Zero(d);
  for (std::size_t i = 0; i < c.count; i += hn::Lanes(d)) {
    const std::size_t live = c.count - i;
    VF share = hn::Set(d, 1.0f);
    if (c.facing != nullptr) share = hn::Mul(share, load_n(d, c.facing + i, live));
    if (c.depth != nullptr) share = hn::Mul(share, load_n(d, c.depth + i, live));
    most = hn::Max(most, hn::IfThenElseZero(hn::FirstN(d, live), share));
  }
  return hn::GetLane(hn::MaxOfLanes(d, most));
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(gauss_keys);
HWY_EXPORT(largest_share);

namespace {

constexpr int kMaxPasses = 3, kMaxDigit = 12;
// Sorts by one digit: counting sort, stable. take(i) is entry i: its key above its row.
template <class Take>
void sort_digit(std::size_t count, int shift, std::uint32_t mask, std::uint32_t* place,
                const Take& take, std::uint64_t* out) {
  std::uint32_t sum = 0;
  for (std::uint32_t digit = 0; digit <= mask; ++digit) {
    const std::uint32_t here = place[digit];
    place[digit] = sum;
    sum += here;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t entry = take(i);
    out[place[static_cast<std::uint32_t>(entry >> 32) >> shift & mask]++] = entry;
  }
}

}  // namespace

float gauss_per_share(const DirectionsView& c) {
  const float most = HWY_DYNAMIC_DISPATCH(largest_share)(c);
  return most > 0 ? std::min(1 / most, 3e38f) : 0.0f;
}

void gauss_sort(const GaussDensity& g, std::size_t count) {
  const int passes = g.axes == 3 ? 2 : 3;
  const int digit = count < 2048  ? 8
                    : g.axes == 3 ? (count < 32768 ? 11 : 12)
                                  : (count < 32768 ? 9 : 10);
  const int bits = HWY_DYNAMIC_DISPATCH(gauss_keys)(g, count, passes * digit / 2 * 2);
  std::uint32_t place[kMaxPasses][1u << kMaxDigit] = {};
  const std::uint32_t mask = (1u << digit) - 1;
  const int used = std::max(1, (bits + digit - 1) / digit);
  for (std::size_t i = 0; i < count; ++i)
    for (int p = 0; p < used; ++p) ++place[p][g.key[i] >> (p * digit) & mask];
  const auto from_keys = [&](std::size_t i) { return std::uint64_t{g.key[i]} << 32 | i; };
  sort_digit(count, 0, mask, place[0], from_keys, g.order[0]);
  const std::uint64_t* last = g.order[0];
  for (int p = 1; p < used; ++p) {
    const std::uint64_t* from = last;
    std::uint64_t* to = g.order[p % 2];
    sort_digit(
        count, p * digit, mask, place[p], [=](std::size_t i) { return from[i]; }, to);
    last = to;
  }
  for (std::size_t i = 0; i < count; ++i) g.source[i] = static_cast<std::uint32_t>(last[i]);
}

}  // namespace h6::kernels
#endif
