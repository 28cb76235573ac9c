// SPDX-License-Identifier: Apache-2.0
// gauss_weights_bench.cpp - density on the Gauss map, n contacts against n.
#include "kernels/weights/gauss_weights.h"

#include <memory>
#include <vector>

#include "bench/kernels/kernel_bench.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

struct Contacts {
  std::vector<float> column[8], weight, want;
  // walls > 0: that many walls, a few degrees rough, contacts of one wall together, as a shell in
  // spatial order gives them; 0: normals everywhere.
  Contacts(std::size_t n, std::size_t walls) : weight(n), want(n) {
    Random random(7);
    double normals[16][3];
    for (auto& v : normals) random.direction(v);
    for (std::size_t i = 0; i < n; ++i) {
      double normal[3], torque[3];
      random.direction(normal);
      random.direction(torque);
      if (walls > 0) {
        double length2 = 0;
        for (int k = 0; k < 3; ++k) {
          normal[k] = normals[i * walls / n][k] + 0.02 * normal[k];
          length2 += normal[k] * normal[k];
        }
        for (double& v : normal) v /= std::sqrt(length2);
      }
      for (int k = 0; k < 3; ++k) {
        column[k].push_back(float(normal[k]));
        column[3 + k].push_back(float(torque[k]));
      }
      column[6].push_back(float(random.uniform(0.5, 1)));
      column[7].push_back(float(random.uniform(1e-5, 1e-3)));
    }
  }
  DirectionsView view() const {
    return {column[0].data(), column[1].data(), column[2].data(),
            column[3].data(), column[4].data(), column[5].data(),
            column[6].data(), column[7].data(), weight.size()};
  }
};

Case make(std::size_t n, std::size_t walls, Hat hat, GaussWidths widths) {
  auto c = std::make_shared<Contacts>(n, walls);
  gauss_weights_ref(c->view(), hat, widths, 0, n, c->want.data());
  return {[=] { gauss_weights(c->view(), hat, widths, 0, n, c->weight.data()); },
          [=] { gauss_weights_ref(c->view(), hat, widths, 0, n, c->weight.data()); },
          [=] {
            for (std::size_t i = 0; i < n; ++i) {
              if (!(std::fabs(c->weight[i] - c->want[i]) <= 1e-5f)) return false;
            }
            return true;
          }};
}

const bool registered = [] {
  const struct {
    const char* name;
    Hat hat;
    GaussWidths widths;
    std::size_t walls;
  } kinds[] = {{"normal", Hat::normal, {0.01f, 0.01f}, 6},
               {"sum", Hat::sum, {0.01f, 0.01f}, 6},
               {"product", Hat::product, {0.05f, 1.0f}, 6},
               {"product-one-wall", Hat::product, {0.05f, 1.0f}, 1},
               {"product-curved", Hat::product, {0.05f, 1.0f}, 0}};
  for (const auto& kind : kinds) {
    for (std::size_t n : {16, 64, 120, 430, 1024, 10000}) {
      add("kernels/gauss_weights/" + std::string(kind.name) + "/n:" + std::to_string(n), n * n,
          [=] { return make(n, kind.walls, kind.hat, kind.widths); });
    }
  }
  return true;
}();

}  // namespace
