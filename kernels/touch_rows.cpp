// touch_rows.cpp - the SIMD twin of touch_rows_ref.cpp.
#include "kernels/touch_rows.h"

#include "kernels/expiry.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/touch_rows.cpp"
#include "kernels/simd.h"
// After simd.h.
#include "hwy/foreach_target.h"
// After foreach_target.h.
#include "hwy/highway.h"
#include "kernels/clearance-inl.h"
#include "kernels/lane_loads-inl.h"
#include "kernels/sample_field-inl.h"

HWY_BEFORE_NAMESPACE();
namespace h6::kernels::HWY_NAMESPACE {

std::size_t touch_rows_simd(const FieldView& field, const Affine& to_field,
                            const PlacesView& places, const std::uint32_t* rows, std::size_t count,
                            float limit, bool wide, float now, const Touching& out,
                            std::uint16_t* expiry) {
  const DF d;
  const DI di;
  const std::size_t width = hn::Lanes(d);
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; k += width) {
    const std::size_t live = HWY_MIN(width, count - k);
    // Lanes that are not live repeat point 0.
    const VI row = load_n(di, reinterpret_cast<const std::int32_t*>(rows) + k, live);
    HWY_ALIGN std::int32_t lane[hn::MaxLanes(di)];
    hn::Store(row, di, lane);
    VI place[4];
    load_quads(
        [&](std::size_t i)
            HWY_ATTR { return places.xyz + std::size_t{3} * static_cast<std::uint32_t>(lane[i]); },
        place);
    const VF x = hn::BitCast(d, place[0]), y = hn::BitCast(d, place[1]);
    const VF z = hn::BitCast(d, place[2]);
    VF distance, gx, gy, gz;
    sample_points<true>(field, affine_row(to_field.m[0], x, y, z),
                        affine_row(to_field.m[1], x, y, z), affine_row(to_field.m[2], x, y, z),
                        distance, gx, gy, gz);

    const VF clear = hn::Max(
        hn::Sub(clearance_of(hn::Sub(distance, hn::Set(d, limit)), wide), hn::Set(d, kExpirySlack)),
        hn::Zero(d));
    const VF until = hn::Mul(hn::Add(clear, hn::Set(d, now)), hn::Set(d, 1.0f / kPointQuantum));
    HWY_ALIGN std::int32_t quanta[hn::MaxLanes(di)];
    hn::Store(hn::ConvertTo(di, hn::Min(until, hn::Set(d, kNeverExpires))), di, quanta);
    for (std::size_t i = 0; i < live; ++i) expiry[lane[i]] = static_cast<std::uint16_t>(quanta[i]);

    const auto touching = hn::And(hn::FirstN(d, live), hn::Lt(distance, hn::Set(d, limit)));
    const std::size_t n = hn::CountTrue(d, touching);
    if (n == 0) continue;
    hn::StoreU(hn::Compress(row, hn::RebindMask(di, touching)), di,
               reinterpret_cast<std::int32_t*>(out.row + written));
    hn::StoreU(hn::Compress(distance, touching), d, out.distance + written);
    hn::StoreU(hn::Compress(gx, touching), d, out.gx + written);
    hn::StoreU(hn::Compress(gy, touching), d, out.gy + written);
    hn::StoreU(hn::Compress(gz, touching), d, out.gz + written);
    written += n;
  }
  return written;
}

}  // namespace h6::kernels::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace h6::kernels {

HWY_EXPORT(touch_rows_simd);

std::size_t touch_rows(const FieldView& field, const Affine& to_field, const PlacesView& places,
                       const std::uint32_t* rows, std::size_t count, float limit, bool wide,
                       float now, const Touching& out, std::uint16_t* expiry) {
  return HWY_DYNAMIC_DISPATCH(touch_rows_simd)(field, to_field, places, rows, count, limit, wide,
                                               now, out, expiry);
}

}  // namespace h6::kernels
#endif
