// SPDX-License-Identifier: Apache-2.0
// sample_field_bench.cpp - distance and gradient at n points: "near" all in bricks, "mixed" within
// 20 voxels of the surface. The set stays in cache between runs when it fits.
#include "kernels/field/sample_field.h"

#include <memory>

#include "bench/kernels/field_bench.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

struct Data {
  ShellPoints points;
  std::vector<float> out[4], want[4];
  Data(std::size_t n, double spread) : points(n, spread) {
    for (int k = 0; k < 4; ++k) out[k].resize(n), want[k].resize(n);
  }
};

template <class Kernel>
void call(const Kernel& kernel, const Data& d, std::vector<float>* out) {
  kernel(ball_field().view(), test::kIdentity,
         PointsView{d.points.x.data(), d.points.y.data(), d.points.z.data(), d.points.x.size()},
         nullptr, d.points.x.size(), out[0].data(), out[1].data(), out[2].data(), out[3].data());
}

Case make(std::size_t n, double spread) {
  auto d = std::make_shared<Data>(n, spread);
  call(sample_field_ref, *d, d->want);
  return {[=] { call(sample_field, *d, d->out); }, [=] { call(sample_field_ref, *d, d->out); },
          [=] {
            for (int k = 0; k < 4; ++k) {
              for (std::size_t i = 0; i < n; ++i) {
                if (!(std::fabs(d->out[k][i] - d->want[k][i]) <= 1e-4f)) return false;
              }
            }
            return true;
          }};
}

const bool registered = [] {
  for (const auto& [name, spread] : {std::pair{"near", 2.0}, std::pair{"mixed", 20.0}}) {
    for (std::size_t n : {16, 64, 256, 1024, 8192, 56823}) {
      add(std::string("kernels/sample_field/") + name + "/n:" + std::to_string(n), n,
          [=, spread = spread] { return make(n, spread); });
    }
  }
  return true;
}();

}  // namespace
