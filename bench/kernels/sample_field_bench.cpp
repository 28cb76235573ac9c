// SPDX-License-Identifier: Apache-2.0
// sample_field_bench.cpp - distance and gradient at n points: "near" all in bricks, "mixed" within
// 20 voxels of the surface. The set stays in cache between runs when it fits. "sample_cross"
// and "sample_ends": six and twelve distances about each of n points near the surface. "creased":
// near points where one cell in ten of those at the surface is cut into quarters; "refined": where
// every one is.
#include "kernels/field/sample_field.h"

#include <memory>

#include "bench/kernels/field_bench.h"
#include "kernels/field/sample_around.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

struct Data {
  const test::AnalyticField& field;
  ShellPoints points;
  std::vector<float> out[12], want[12];
  Data(std::size_t n, double spread, const test::AnalyticField& in) : field(in), points(n, spread) {
    for (int k = 0; k < 12; ++k) out[k].resize(n), want[k].resize(n);
  }
};

template <class Kernel>
void call(const Kernel& kernel, const Data& d, std::vector<float>* out) {
  kernel(d.field.view(), test::kIdentity,
         PointsView{d.points.x.data(), d.points.y.data(), d.points.z.data(), d.points.x.size()},
         nullptr, d.points.x.size(), out[0].data(), out[1].data(), out[2].data(), out[3].data());
}

using Around = void (*)(const FieldView&, const Affine&, const PointsView&, float, float* const*);

void call_around(Around kernel, float step, const Data& d, std::vector<float>* out) {
  float* at[12];
  for (int k = 0; k < 12; ++k) at[k] = out[k].data();
  kernel(d.field.view(), test::kIdentity,
         PointsView{d.points.x.data(), d.points.y.data(), d.points.z.data(), d.points.x.size()},
         step, at);
}

bool agrees(const Data& d) {
  for (int k = 0; k < 12; ++k)
    for (std::size_t i = 0; i < d.out[k].size(); ++i)
      if (!(std::fabs(d.out[k][i] - d.want[k][i]) <= 1e-4f)) return false;
  return true;
}

Case make(std::size_t n, double spread, const test::AnalyticField& field) {
  auto d = std::make_shared<Data>(n, spread, field);
  call(sample_field_ref, *d, d->want);
  return {[=] { call(sample_field, *d, d->out); }, [=] { call(sample_field_ref, *d, d->out); },
          [=] { return agrees(*d); }};
}

Case make_around(std::size_t n, const test::AnalyticField& field, float step, Around kernel,
                 Around reference) {
  auto d = std::make_shared<Data>(n, 1.5, field);
  call_around(reference, step, *d, d->want);
  return {[=] { call_around(kernel, step, *d, d->out); },
          [=] { call_around(reference, step, *d, d->out); }, [=] { return agrees(*d); }};
}

template <void (*kKernel)(const FieldView&, const Affine&, const PointsView&, float* const*)>
void ends(const FieldView& field, const Affine& a, const PointsView& p, float, float* const* at) {
  kKernel(field, a, p, at);
}

// `field` makes the field when a case first runs.
template <class Field>
void add_around(const std::string& rest, std::size_t n, const Field& field) {
  add("kernels/sample_cross/" + rest, n,
      [=] { return make_around(n, field(), 0.125f, sample_cross, sample_cross_ref); });
  add("kernels/sample_ends/" + rest, n,
      [=] { return make_around(n, field(), 1, ends<sample_ends>, ends<sample_ends_ref>); });
}

const bool registered = [] {
  for (const auto& [name, spread] : {std::pair{"near", 2.0}, std::pair{"mixed", 20.0}}) {
    for (std::size_t n : {16, 64, 256, 1024, 8192, 56823}) {
      add(std::string("kernels/sample_field/") + name + "/n:" + std::to_string(n), n,
          [=, spread = spread] { return make(n, spread, ball_field()); });
    }
  }
  for (std::size_t n : {64, 1024, 16384})
    add_around("n:" + std::to_string(n), n,
               []() -> const test::AnalyticField& { return ball_field(); });
  for (const auto& [name, every] : {std::pair{"creased", 10}, std::pair{"refined", 1}})
    for (std::size_t n : {1024, 8192}) {
      const std::string rest = std::string(name) + "/n:" + std::to_string(n);
      add("kernels/sample_field/" + rest, n,
          [=, every = every] { return make(n, 2.0, cut_field(every)); });
      add_around(rest, n,
                 [every = every]() -> const test::AnalyticField& { return cut_field(every); });
    }
  return true;
}();

}  // namespace
