// expiry.cpp - the SIMD twin of expiry_ref.cpp.
#include "kernels/expiry.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/expiry.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, kBlock>;
using DI = hn::RebindToSigned<DF>;

std::size_t expired_simd(const float* values, const std::uint32_t* blocks, std::size_t count,
                         float now, std::uint32_t* out) {
  const DF d;
  const DI di;
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = kBlock * (blocks != nullptr ? blocks[k] : k);
    for (std::size_t i = first; i < first + kBlock; i += hn::Lanes(d)) {
      const auto gone = hn::Le(hn::LoadU(d, values + i), hn::Set(d, now));
      const std::size_t n = hn::CountTrue(d, gone);
      if (n == 0) continue;
      const auto index = hn::Iota(di, static_cast<std::int32_t>(i));
      hn::StoreU(hn::Compress(index, hn::RebindMask(di, gone)), di,
                 reinterpret_cast<std::int32_t*>(out + written));
      written += n;
    }
  }
  return written;
}

std::size_t mostly_expired_simd(const float* values, const std::uint32_t* blocks,
                                std::size_t count, float now, std::size_t most,
                                std::uint32_t* out) {
  const DF d;
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const float* first = values + kBlock * blocks[k];
    std::size_t n = 0;
    for (std::size_t i = 0; i < kBlock; i += hn::Lanes(d))
      n += hn::CountTrue(d, hn::Le(hn::LoadU(d, first + i), hn::Set(d, now)));
    out[written] = blocks[k];
    written += n >= most;
  }
  return written;
}

void least_of_blocks_simd(const float* values, const std::uint32_t* blocks, std::size_t count,
                          float* out) {
  const DF d;
  for (std::size_t k = 0; k < count; ++k) {
    const float* first = values + kBlock * blocks[k];
    auto least = hn::LoadU(d, first);
    for (std::size_t i = hn::Lanes(d); i < kBlock; i += hn::Lanes(d))
      least = hn::Min(least, hn::LoadU(d, first + i));
    out[blocks[k]] = hn::GetLane(hn::MinOfLanes(d, least));
  }
}

using DU = hn::Rebind<std::uint16_t, DI>;

// Expiries of points from `row` on, in quanta; those that are none never expire.
HWY_INLINE hn::Vec<DI> load_expiries(const PointExpiries& points, std::size_t row) {
  const DU du;
  const DI di;
  if (HWY_LIKELY(row + hn::Lanes(di) <= points.points))
    return hn::PromoteTo(di, hn::LoadU(du, points.value + row));
  const std::size_t live = row < points.points ? points.points - row : 0;
  HWY_ALIGN std::uint16_t lanes[hn::MaxLanes(du)];
  for (std::size_t i = 0; i < hn::Lanes(di); ++i)
    lanes[i] = i < live ? points.value[row + i] : std::uint16_t{65535};
  return hn::PromoteTo(di, hn::Load(du, lanes));
}

HWY_INLINE bool known_group(const PointExpiries& points, std::uint32_t group) {
  return (points.known[group / kBlock] >> group % kBlock & 1) != 0;
}
// The first quantum that has not expired; the last of 16 bits never does.
HWY_INLINE hn::Vec<DI> beyond(float now) {
  const float q = now / kPointQuantum;
  return hn::Set(DI(), q < 0 ? 0 : q < 65534.0f ? static_cast<std::int32_t>(q) + 1 : 65535);
}

std::size_t mostly_expired_points_simd(const PointExpiries& points, const std::uint32_t* groups,
                                       std::size_t count, float now, std::size_t most,
                                       std::uint32_t* out) {
  const DI di;
  const auto way = beyond(now);
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < kBlock; i += hn::Lanes(di))
      n += hn::CountTrue(di, hn::Lt(load_expiries(points, kBlock * groups[k] + i), way));
    out[written] = groups[k];
    written += n >= most || !known_group(points, groups[k]);
  }
  return written;
}

std::size_t expired_points_simd(const PointExpiries& points, const std::uint32_t* groups,
                                std::size_t count, float now, std::uint32_t* out) {
  const DI di;
  const auto way = beyond(now);
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const bool known = known_group(points, groups[k]);
    for (std::size_t i = 0; i < kBlock; i += hn::Lanes(di)) {
      const std::size_t row = kBlock * groups[k] + i;
      const auto index = hn::Iota(di, static_cast<std::int32_t>(row));
      const auto gone =
          known ? hn::Lt(load_expiries(points, row), way)
                : hn::Lt(index, hn::Set(di, static_cast<std::int32_t>(points.points)));
      hn::StoreU(hn::Compress(index, gone), di, reinterpret_cast<std::int32_t*>(out + written));
      written += hn::CountTrue(di, gone);
    }
  }
  return written;
}

void least_of_points_simd(const PointExpiries& points, const std::uint32_t* groups,
                          std::size_t count, float* out) {
  const DI di;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = kBlock * groups[k];
    auto least = load_expiries(points, first);
    for (std::size_t i = hn::Lanes(di); i < kBlock; i += hn::Lanes(di))
      least = hn::Min(least, load_expiries(points, first + i));
    out[groups[k]] = kPointQuantum * static_cast<float>(hn::GetLane(hn::MinOfLanes(di, least)));
  }
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(expired_simd);
HWY_EXPORT(mostly_expired_simd);
HWY_EXPORT(least_of_blocks_simd);
HWY_EXPORT(mostly_expired_points_simd);
HWY_EXPORT(expired_points_simd);
HWY_EXPORT(least_of_points_simd);

std::size_t expired(const float* values, const std::uint32_t* blocks, std::size_t count, float now,
                    std::uint32_t* out) {
  return HWY_DYNAMIC_DISPATCH(expired_simd)(values, blocks, count, now, out);
}

std::size_t mostly_expired(const float* values, const std::uint32_t* blocks, std::size_t count,
                           float now, std::size_t most, std::uint32_t* out) {
  return HWY_DYNAMIC_DISPATCH(mostly_expired_simd)(values, blocks, count, now, most, out);
}

std::size_t mostly_expired_points(const PointExpiries& points, const std::uint32_t* groups,
                                  std::size_t count, float now, std::size_t most,
                                  std::uint32_t* out) {
  return HWY_DYNAMIC_DISPATCH(mostly_expired_points_simd)(points, groups, count, now, most, out);
}

std::size_t expired_points(const PointExpiries& points, const std::uint32_t* groups,
                           std::size_t count, float now, std::uint32_t* out) {
  return HWY_DYNAMIC_DISPATCH(expired_points_simd)(points, groups, count, now, out);
}

void least_of_points(const PointExpiries& points, const std::uint32_t* groups, std::size_t count,
                     float* out) {
  HWY_DYNAMIC_DISPATCH(least_of_points_simd)(points, groups, count, out);
}

void least_of_blocks(const float* values, const std::uint32_t* blocks, std::size_t count,
                     float* out) {
  HWY_DYNAMIC_DISPATCH(least_of_blocks_simd)(values, blocks, count, out);
}

}  // namespace h6::kernels
#endif
