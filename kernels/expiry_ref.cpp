// expiry_ref.cpp - the specification of expiry.
#include <algorithm>

#include "kernels/expiry.h"

namespace h6::kernels {
namespace {

bool is_known(const PointExpiries& points, std::uint32_t group) {
  return (points.known[group / kBlock] >> group % kBlock & 1) != 0;
}
bool is_expired(const PointExpiries& points, std::size_t row, float now) {
  return row < points.points && kPointQuantum * points.value[row] <= now;
}

}  // namespace

std::size_t expired_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                        float now, std::uint32_t* out) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t first = kBlock * (blocks != nullptr ? blocks[k] : k);
    for (std::size_t i = first; i < first + kBlock; ++i)
      if (values[i] <= now) out[written++] = static_cast<std::uint32_t>(i);
  }
  return written;
}

std::size_t mostly_expired_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                               float now, std::size_t most, std::uint32_t* out) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const float* first = values + kBlock * blocks[k];
    const auto n = std::count_if(first, first + kBlock, [now](float v) { return v <= now; });
    if (static_cast<std::size_t>(n) >= most) out[written++] = blocks[k];
  }
  return written;
}

void least_of_blocks_ref(const float* values, const std::uint32_t* blocks, std::size_t count,
                         float* out) {
  for (std::size_t k = 0; k < count; ++k) {
    const float* first = values + kBlock * blocks[k];
    out[blocks[k]] = *std::min_element(first, first + kBlock);
  }
}

std::size_t mostly_expired_points_ref(const PointExpiries& points, const std::uint32_t* groups,
                                      std::size_t count, float now, std::size_t most,
                                      std::uint32_t* out) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    std::size_t n = 0;
    for (std::size_t i = 0; i < kBlock; ++i) n += is_expired(points, kBlock * groups[k] + i, now);
    if (!is_known(points, groups[k]) || n >= most) out[written++] = groups[k];
  }
  return written;
}

std::size_t expired_points_ref(const PointExpiries& points, const std::uint32_t* groups,
                               std::size_t count, float now, std::uint32_t* out) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const bool known = is_known(points, groups[k]);
    for (std::size_t row = kBlock * groups[k]; row < kBlock * (groups[k] + 1); ++row)
      if (known ? is_expired(points, row, now) : row < points.points)
        out[written++] = static_cast<std::uint32_t>(row);
  }
  return written;
}

void least_of_points_ref(const PointExpiries& points, const std::uint32_t* groups,
                         std::size_t count, float* out) {
  for (std::size_t k = 0; k < count; ++k) {
    std::uint16_t least = 65535;
    for (std::size_t row = kBlock * groups[k]; row < kBlock * (groups[k] + 1); ++row)
      if (row < points.points) least = std::min(least, points.value[row]);
    out[groups[k]] = kPointQuantum * least;
  }
}

}  // namespace h6::kernels
