// SPDX-License-Identifier: Apache-2.0
// contact_wrench_bench.cpp - wrench, stiffness and damping of n contacts.
#include "kernels/contact/contact_wrench.h"

#include <memory>
#include <vector>

#include "bench/kernels/kernel_bench.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

struct Contacts {
  std::vector<float> column[11];
  WrenchSum sum, want;
  explicit Contacts(std::size_t n) {
    Random random(5);
    for (std::size_t i = 0; i < n; ++i) {
      double v[3];
      column[0].push_back(float(random.uniform(0, 1e-3)));
      column[1].push_back(float(random.uniform(0, 1)));
      for (int group = 0; group < 3; ++group) {
        random.direction(v);
        for (int k = 0; k < 3; ++k) column[2 + 3 * group + k].push_back(float(v[k]));
      }
    }
  }
  WrenchColumns view() const {
    const auto p = [&](int k) { return column[k].data(); };
    return {p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7), p(8), p(9), p(10), column[0].size()};
  }
};

Case make(std::size_t n, bool exact) {
  auto c = std::make_shared<Contacts>(n);
  const WrenchParameters p = {1e4, 1e-3, {0.1, 0.2, -0.1, 0.3, -0.2, 0.1}, exact};
  c->want = contact_wrench_ref(c->view(), p, 0, n);
  return {[=] { c->sum = contact_wrench(c->view(), p, 0, n); },
          [=] { c->sum = contact_wrench_ref(c->view(), p, 0, n); },
          [=] {
            const double scale = 1e4 * double(n) * 1e-12;
            for (int k = 0; k < 36; ++k) {
              if (!(std::fabs(c->sum.stiffness[k] - c->want.stiffness[k]) <= scale)) return false;
              if (!(std::fabs(c->sum.damping[k] - c->want.damping[k]) <= scale)) return false;
            }
            for (int k = 0; k < 6; ++k) {
              if (!(std::fabs(c->sum.force[k] - c->want.force[k]) <= scale)) return false;
            }
            return true;
          }};
}

const bool registered = [] {
  for (bool exact : {false, true}) {
    for (std::size_t n : {16, 64, 120, 430, 1024, 10000}) {
      add(std::string("kernels/contact_wrench/") + (exact ? "exact" : "symmetric") +
              "/n:" + std::to_string(n),
          n, [=] { return make(n, exact); });
    }
  }
  return true;
}();

}  // namespace
