// SPDX-License-Identifier: Apache-2.0
// histogram.h - percentiles of any number of durations in fixed memory.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace h6::cli {

// Each bin is 1 % wider than the one before, from 0.01 us to 100 s. So percentiles are accurate to
// 1 %; the maximum is exact.
class Histogram {
 public:
  void add(double us) {
    const double bin = us > kLeast ? std::log(us / kLeast) / kStep : 0;
    ++bins_[static_cast<std::size_t>(std::clamp(bin, 0.0, kBins - 1.0))];
    ++count_;
    sum_ += us;
    max_ = std::max(max_, us);
  }
  double percentile(double p) const {
    if (count_ == 0) return 0;
    const auto rank = static_cast<std::uint64_t>(std::ceil(p / 100 * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < bins_.size(); ++i)
      if ((seen += bins_[i]) >= std::max<std::uint64_t>(rank, 1))
        return std::min(max_, kLeast * std::exp(kStep * (static_cast<double>(i) + 0.5)));
    return max_;
  }
  double max() const { return max_; }
  double mean() const { return count_ ? sum_ / static_cast<double>(count_) : 0; }

 private:
  static constexpr double kLeast = 0.01, kStep = 0.01, kBins = 2304;
  std::array<std::uint64_t, 2304> bins_{};
  std::uint64_t count_ = 0;
  double sum_ = 0, max_ = 0;
};

}  // namespace h6::cli
