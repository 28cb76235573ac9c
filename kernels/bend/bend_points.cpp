// SPDX-License-Identifier: Apache-2.0
// bend_points.cpp - the SIMD twin of bend_points_ref.cpp. Sums run over modes in order, in lanes;
// they agree with the reference to the rounding of a fused product.
#include "kernels/bend/bend_points.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/bend/bend_points.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/bend/carried-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void points_simd(const ModesView& modes, const float* q, const float* const rest[3],
                 const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  const DF d;
  each_register(vectors, n, [&](std::size_t v, std::size_t lane) HWY_ATTR {
    const Carried<3> way(modes, q, v, lane);
    const std::size_t i = v * kBendLanes + lane;
    for (int a = 0; a < 3; ++a)
      hn::StoreU(hn::Add(hn::LoadU(d, rest[a] + i), way.axis[a]), d, to[a] + i);
  });
}

void normals_simd(const ModesView& modes, const float* q, const float* const rest[3],
                  const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  const DF d;
  each_register(vectors, n, [&](std::size_t v, std::size_t lane) HWY_ATTR {
    Carried<3> bent(modes, q, v, lane);
    const std::size_t i = v * kBendLanes + lane;
    VF before[3];
    for (int a = 0; a < 3; ++a) {
      before[a] = hn::LoadU(d, rest[a] + i);
      bent.axis[a] = hn::Add(before[a], bent.axis[a]);
    }
    const VF length = bent.length();
    const auto has_one = hn::Gt(length, hn::Set(d, 1e-6f));
    for (int a = 0; a < 3; ++a)
      hn::StoreU(hn::IfThenElse(has_one, hn::Div(bent.axis[a], length), before[a]), d, to[a] + i);
  });
}

void spheres_simd(const ModesView& modes, const float* q, const float* const rest[4],
                  const std::uint32_t* vectors, std::size_t n, float* const to[4]) {
  const DF d;
  each_register(vectors, n, [&](std::size_t v, std::size_t lane) HWY_ATTR {
    const Carried<3, 1> way(modes, q, v, lane);
    const std::size_t i = v * kBendLanes + lane;
    for (int a = 0; a < 3; ++a)
      hn::StoreU(hn::Add(hn::LoadU(d, rest[a] + i), way.axis[a]), d, to[a] + i);
    const VF radius = hn::Add(hn::LoadU(d, rest[3] + i), way.axis[3]);
    hn::StoreU(hn::Mul(radius, hn::Set(d, kRoundUp)), d, to[3] + i);
  });
}

float reach_simd(const ModesView& modes, const float* q, std::size_t n) {
  const DF d;
  VF most = hn::Zero(d);
  each_register(nullptr, n, [&](std::size_t v, std::size_t lane) HWY_ATTR {
    const Carried<3, 1> way(modes, q, v, lane);
    most = hn::Max(most, hn::Mul(hn::Add(way.length(), way.axis[3]), hn::Set(d, kRoundUp)));
  });
  return hn::GetLane(hn::MaxOfLanes(d, most));
}

// Contacts of one vector are put into the lanes of their rows, so that modes are read as they lie.
void rows_simd(const BentContacts& c, const ModesView& modes, const float turn[9],
               std::size_t stride, float* out) {
  HWY_ALIGN float local[3][kBendLanes];
  each_vector(c, [&](std::size_t v, std::size_t first, std::size_t end) HWY_ATTR {
    rigid_rows(c, first, end, turn, stride, out, local);
    modal_rows<3>(c, modes, v, first, end, local, stride, out);
  });
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(points_simd);
HWY_EXPORT(normals_simd);
HWY_EXPORT(spheres_simd);
HWY_EXPORT(reach_simd);
HWY_EXPORT(rows_simd);

void bend_points(const ModesView& modes, const float* q, const float* const rest[3],
                 const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  HWY_DYNAMIC_DISPATCH(points_simd)(modes, q, rest, vectors, n, to);
}
void bend_normals(const ModesView& modes, const float* q, const float* const rest[3],
                  const std::uint32_t* vectors, std::size_t n, float* const to[3]) {
  HWY_DYNAMIC_DISPATCH(normals_simd)(modes, q, rest, vectors, n, to);
}
void bend_spheres(const ModesView& modes, const float* q, const float* const rest[4],
                  const std::uint32_t* vectors, std::size_t n, float* const to[4]) {
  HWY_DYNAMIC_DISPATCH(spheres_simd)(modes, q, rest, vectors, n, to);
}
float bend_reach(const ModesView& modes, const float* q, std::size_t n) {
  return HWY_DYNAMIC_DISPATCH(reach_simd)(modes, q, n);
}
void contact_rows(const BentContacts& contacts, const ModesView& modes, const float turn[9],
                  std::size_t stride, float* out) {
  HWY_DYNAMIC_DISPATCH(rows_simd)(contacts, modes, turn, stride, out);
}

}  // namespace h6::kernels
#endif
