// triangle_distance.cpp - the fast twin of triangle_distance_ref.
//
// Nodes are visited in Morton order, so that 16 in a row are a compact block of 4 x 2 x 2 nodes.
// For each triangle, one vector pass over the 32 blocks finds those it can still bring something
// nearer (box gap and plane gap against the worst distance in the block); only they are evaluated.
#include "kernels/triangle_distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/triangle_distance.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef H6_TRIANGLE_DISTANCE_TABLES
#define H6_TRIANGLE_DISTANCE_TABLES
namespace h6::kernels {

inline constexpr std::size_t kBlock = 16;  // nodes: 4 x 2 x 2
inline constexpr std::size_t kBlocks = kBrickSamples / kBlock;
inline constexpr float kBlockHalf[3] = {1.5f, 0.5f, 0.5f};

struct MortonNodes {
  alignas(64) float x[kBrickSamples], y[kBrickSamples], z[kBrickSamples];
  alignas(64) float middle_x[kBlocks], middle_y[kBlocks], middle_z[kBlocks];
  std::array<std::uint16_t, kBrickSamples> row;  // Morton -> x fastest
};

constexpr MortonNodes morton_nodes() {
  MortonNodes m{};
  for (std::size_t n = 0; n < kBrickSamples; ++n) {
    std::size_t c[3] = {0, 0, 0};
    for (std::size_t bit = 0; bit < 9; ++bit) c[bit % 3] |= (n >> bit & 1) << (bit / 3);
    m.x[n] = float(c[0]);
    m.y[n] = float(c[1]);
    m.z[n] = float(c[2]);
    m.row[n] = static_cast<std::uint16_t>((c[2] * 8 + c[1]) * 8 + c[0]);
  }
  for (std::size_t b = 0; b < kBlocks; ++b) {
    m.middle_x[b] = m.x[b * kBlock] + kBlockHalf[0];
    m.middle_y[b] = m.y[b * kBlock] + kBlockHalf[1];
    m.middle_z[b] = m.z[b * kBlock] + kBlockHalf[2];
  }
  return m;
}
inline constexpr MortonNodes kNodes = morton_nodes();

// One triangle, ready for float work. Its unit normal is made in double: on a long sliver a float
// cross product is wrong by whole voxels at the far end.
struct Facet {
  float corner[3][3];  // a, b, c
  float edge[3][3];    // ab, bc, ca
  float inverse[3];    // 1 / length^2 of each edge; 0 for a point
  float inward[3][3];  // normal x edge: positive on the triangle's side of the edge
  float normal[3];     // unit; 0 without area
  float level;         // normal . a
  float middle[3];     // of the bounding box
  float half[3];       // of the bounding box, plus half a block
  float block_reach;   // of a block along the normal
  bool area;
};

inline Facet make_facet(const double* t) {
  Facet f;
  double edge[3][3], n[3];
  for (int k = 0; k < 3; ++k) {
    edge[0][k] = t[3 + k] - t[k];
    edge[1][k] = t[6 + k] - t[3 + k];
    edge[2][k] = t[k] - t[6 + k];
    const double low = std::min({t[k], t[3 + k], t[6 + k]});
    const double high = std::max({t[k], t[3 + k], t[6 + k]});
    f.middle[k] = float(0.5 * (low + high));
    f.half[k] = float(0.5 * (high - low)) + kBlockHalf[k];
  }
  double longest2 = 0;
  for (int e = 0; e < 3; ++e) {
    const double* v = edge[e];
    const double length2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    longest2 = std::max(longest2, length2);
    f.inverse[e] = length2 > 1e-12 ? float(1.0 / length2) : 0.0f;
  }
  const double *u = edge[2], *v = edge[0];
  n[0] = u[1] * v[2] - u[2] * v[1];
  n[1] = u[2] * v[0] - u[0] * v[2];
  n[2] = u[0] * v[1] - u[1] * v[0];
  const double n2 = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
  // Below a height of 1e-4 voxel the edges alone are right to half of that.
  f.area = n2 > 1e-8 * longest2;
  const double scale = f.area ? 1.0 / std::sqrt(n2) : 0.0;
  for (double& c : n) c *= scale;
  f.level = float(n[0] * t[0] + n[1] * t[1] + n[2] * t[2]);
  f.block_reach = 0;
  for (int k = 0; k < 3; ++k) {
    f.normal[k] = float(n[k]);
    f.block_reach += kBlockHalf[k] * std::fabs(f.normal[k]);
    const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    for (int e = 0; e < 3; ++e) {
      f.corner[e][k] = float(t[3 * e + k]);
      f.edge[e][k] = float(edge[e][k]);
      f.inward[e][k] = float(n[k1] * edge[e][k2] - n[k2] * edge[e][k1]);
    }
  }
  return f;
}

}  // namespace h6::kernels
#endif

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, kBlock>;
using VF = hn::Vec<D>;

// Bit b: block b has a node that this triangle may be nearer to than anything before.
HWY_INLINE std::uint32_t live_blocks(const Facet& f, const float* worst) {
  const D d;
  const VF zero = hn::Zero(d);
  std::uint32_t live = 0;
  for (std::size_t b = 0; b < kBlocks; b += hn::Lanes(d)) {
    const VF x = hn::Load(d, kNodes.middle_x + b), y = hn::Load(d, kNodes.middle_y + b),
             z = hn::Load(d, kNodes.middle_z + b);
    const auto gap = [&](VF c, int k) HWY_ATTR {
      const VF away = hn::Abs(hn::Sub(c, hn::Set(d, f.middle[k])));
      return hn::Max(hn::Sub(away, hn::Set(d, f.half[k])), zero);
    };
    const VF gx = gap(x, 0), gy = gap(y, 1), gz = gap(z, 2);
    const VF box2 = hn::MulAdd(gx, gx, hn::MulAdd(gy, gy, hn::Mul(gz, gz)));
    VF plane = hn::MulAdd(x, hn::Set(d, f.normal[0]),
                          hn::MulAdd(y, hn::Set(d, f.normal[1]),
                                     hn::MulSub(z, hn::Set(d, f.normal[2]), hn::Set(d, f.level))));
    plane = hn::Max(hn::Sub(hn::Abs(plane), hn::Set(d, f.block_reach)), zero);
    const VF bound = hn::Max(box2, hn::Mul(plane, plane));
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, hn::Lt(bound, hn::Load(d, worst + b)), bits);
    const std::uint32_t mask = (std::uint32_t{bits[0]} | std::uint32_t{bits[1]} << 8);
    live |= mask << b;
  }
  return live;
}

HWY_INLINE VF squared_distance(const Facet& f, VF x, VF y, VF z) {
  const D d;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  VF nearest = hn::Set(d, 1e30f), inside = nearest;
  for (int e = 0; e < 3; ++e) {
    const VF wx = hn::Sub(x, hn::Set(d, f.corner[e][0]));
    const VF wy = hn::Sub(y, hn::Set(d, f.corner[e][1]));
    const VF wz = hn::Sub(z, hn::Set(d, f.corner[e][2]));
    const auto along = [&](const float* v) HWY_ATTR {
      return hn::MulAdd(wx, hn::Set(d, v[0]),
                        hn::MulAdd(wy, hn::Set(d, v[1]), hn::Mul(wz, hn::Set(d, v[2]))));
    };
    const VF t = hn::Min(hn::Max(hn::Mul(along(f.edge[e]), hn::Set(d, f.inverse[e])), zero), one);
    const VF gx = hn::NegMulAdd(t, hn::Set(d, f.edge[e][0]), wx);
    const VF gy = hn::NegMulAdd(t, hn::Set(d, f.edge[e][1]), wy);
    const VF gz = hn::NegMulAdd(t, hn::Set(d, f.edge[e][2]), wz);
    nearest = hn::Min(nearest, hn::MulAdd(gx, gx, hn::MulAdd(gy, gy, hn::Mul(gz, gz))));
    inside = hn::Min(inside, along(f.inward[e]));
  }
  if (!f.area) return nearest;
  const VF height =
      hn::MulAdd(x, hn::Set(d, f.normal[0]),
                 hn::MulAdd(y, hn::Set(d, f.normal[1]),
                            hn::MulSub(z, hn::Set(d, f.normal[2]), hn::Set(d, f.level))));
  return hn::IfThenElse(hn::Ge(inside, zero), hn::Mul(height, height), nearest);
}

void TriangleDistance(const double* corners, std::size_t count, float reach, float* distance) {
  const D d;
  alignas(64) float best[kBrickSamples], worst[kBlocks];
  std::fill(best, best + kBrickSamples, reach * reach);
  std::fill(worst, worst + kBlocks, reach * reach);
  for (std::size_t i = 0; i < count; ++i) {
    const Facet f = make_facet(corners + 9 * i);
    for (std::uint32_t live = live_blocks(f, worst); live != 0; live &= live - 1) {
      const std::size_t b = hwy::Num0BitsBelowLS1Bit_Nonzero32(live);
      VF farthest = hn::Zero(d);
      for (std::size_t n = b * kBlock; n < (b + 1) * kBlock; n += hn::Lanes(d)) {
        const VF squared = squared_distance(f, hn::Load(d, kNodes.x + n), hn::Load(d, kNodes.y + n),
                                            hn::Load(d, kNodes.z + n));
        const VF nearest = hn::Min(squared, hn::Load(d, best + n));
        hn::Store(nearest, d, best + n);
        farthest = hn::Max(farthest, nearest);
      }
      worst[b] = hn::GetLane(hn::MaxOfLanes(d, farthest));
    }
  }
  for (std::size_t n = 0; n < kBrickSamples; n += hn::Lanes(d))
    hn::Store(hn::Sqrt(hn::Load(d, best + n)), d, best + n);
  for (std::size_t n = 0; n < kBrickSamples; ++n) distance[kNodes.row[n]] = best[n];
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(TriangleDistance);

void triangle_distance(const double* corners, std::size_t count, float reach, float* distance) {
  HWY_DYNAMIC_DISPATCH(TriangleDistance)(corners, count, reach, distance);
}

}  // namespace h6::kernels
#endif
