// SPDX-License-Identifier: Apache-2.0
// cull_spheres_bench.cpp - spheres of up to 6 voxels radius, within 20 voxels of the surface.
#include "kernels/contact/cull_spheres.h"

#include <memory>

#include "bench/kernels/field_bench.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

struct Data {
  ShellPoints spheres;
  std::vector<std::uint32_t> rows, survivors, want;
  std::size_t count = 0;
  explicit Data(std::size_t n) : spheres(n, 20), rows(n), survivors(n), want(n) {
    std::iota(rows.begin(), rows.end(), 0u);
  }
};

template <class Kernel>
std::size_t call(const Kernel& kernel, Data& d, std::vector<std::uint32_t>& out) {
  const ShellPoints& s = d.spheres;
  return kernel(ball_field().view(), test::kIdentity,
                SpheresView{s.x.data(), s.y.data(), s.z.data(), s.radius.data(), s.x.size()}, 1.0f,
                Reach{}, 0.0f, d.rows.data(), 0u, d.rows.size(), out.data(), nullptr, true);
}

Case make(std::size_t n) {
  auto d = std::make_shared<Data>(n);
  d->want.resize(call(cull_spheres_ref, *d, d->want));
  return {[=] { d->count = call(cull_spheres, *d, d->survivors); },
          [=] { d->count = call(cull_spheres_ref, *d, d->survivors); },
          [=] {
            return d->count == d->want.size() &&
                   std::equal(d->want.begin(), d->want.end(), d->survivors.begin());
          }};
}

const bool registered = [] {
  for (std::size_t n : {16, 64, 256, 1024, 8192, 56823}) {
    add("kernels/cull_spheres/n:" + std::to_string(n), n, [=] { return make(n); });
  }
  return true;
}();

}  // namespace
