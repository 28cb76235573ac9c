// SPDX-License-Identifier: Apache-2.0
// series_solve_bench.cpp - loads of n contacts, from nothing and from the last frame's extension.
#include "kernels/weights/series_solve.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "bench/kernels/kernel_bench.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

// The lower half of a ball of 10 mm in a bowl, in 0.3 mm at the bottom.
struct Contacts {
  std::vector<float> column[7], kappa, slack;
  double start[6] = {}, y[6] = {}, want[6] = {};
  Contacts(std::size_t n, bool warm) : kappa(n), slack(n) {
    for (std::size_t i = 0; i < n; ++i) {
      const double z = -(i + 0.5) / n, r = std::sqrt(1 - z * z), a = 2.399963229728653 * i;
      const double out[3] = {r * std::cos(a), r * std::sin(a), z};
      for (int k = 0; k < 3; ++k) {
        column[k].push_back(float(-out[k]));
        column[3 + k].push_back(float(0.01 * out[k] + 0.001 * k));
      }
      column[6].push_back(float(-0.3e-3 * z));
    }
    const SeriesParameters p{4, 0.015};
    if (warm) series_solve_ref(view(), p, start, kappa.data(), slack.data());
    for (float& e : column[6]) e *= 1.002f;  // a frame later
    series_solve_ref(view(), p, want, kappa.data(), slack.data());
  }
  SeriesColumns view() const {
    const auto p = [&](int k) { return column[k].data(); };
    return {p(0), p(1), p(2), p(3), p(4), p(5), p(6), nullptr, column[0].size()};
  }
};

Case make(std::size_t n, bool warm) {
  auto c = std::make_shared<Contacts>(n, warm);
  const SeriesParameters p{4, 0.015};
  const auto with = [c, p](auto&& solve) {
    std::copy_n(c->start, 6, c->y);
    solve(c->view(), p, c->y, c->kappa.data(), c->slack.data());
  };
  return {[=] { with([](auto&&... a) { series_solve(a...); }); },
          [=] { with([](auto&&... a) { series_solve_ref<float>(a...); }); },
          [=] {
            for (int k = 0; k < 6; ++k)
              if (!(std::fabs(c->y[k] - c->want[k]) <= 1e-9)) return false;
            return true;
          }};
}

[[maybe_unused]] const bool registered = [] {
  for (const bool warm : {false, true})
    for (std::size_t n : {16, 120, 1000, 10000})
      add(std::string("kernels/series_solve/") + (warm ? "warm" : "cold") +
              "/n:" + std::to_string(n),
          n, [=] { return make(n, warm); });
  return true;
}();

}  // namespace
