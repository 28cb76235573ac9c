// SPDX-License-Identifier: Apache-2.0
// gauss_tree_bench.cpp - density on the Gauss map by the tree, by the sweep and, for few contacts,
// by every pair once.
//
// Sets: spread (directions everywhere), clump (as wide as the hats), walls (six, rough, wall by
// wall, torque directions of arms on them), one-normal (a flat wall), equal.
#include "kernels/weights/gauss_tree.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "bench/kernels/kernel_bench.h"
#include "kernels/weights/gauss_few.h"
#include "kernels/weights/gauss_sweep.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

struct Rule {
  const char* name;
  Hat hat;
  GaussWidths widths;
  bool weighted;
};

struct Contacts {
  std::vector<float> column[8], weight, want;
  std::vector<char> memory;
  std::size_t step;  // between contacts that are compared

  Contacts(const std::string& set, std::size_t n, const Rule& rule)
      : weight(n),
        want(n),
        memory(std::max(gauss_tree_bytes(n, rule.hat), gauss_sweep_bytes(n, rule.hat))),
        step(n > 2000 ? n / 500 : 1) {
    Random random(7);
    double poles[7][3];
    for (auto& pole : poles) random.direction(pole);
    for (std::size_t i = 0; i < n; ++i) {
      double normal[3], torque[3], arm[3];
      random.direction(normal);
      random.direction(torque);
      random.direction(arm);
      if (set == "clump") {
        near_to(random, poles[0], rule.widths.normal, normal);
        near_to(random, poles[6], rule.widths.torque, torque);
      } else if (set == "equal") {
        std::copy_n(poles[0], 3, normal), std::copy_n(poles[6], 3, torque);
      } else if (set == "one-normal" || set == "walls") {
        const double* wall = poles[set == "walls" ? i * 6 / n : 0];
        for (int k = 0; k < 3; ++k) normal[k] = wall[k];
        if (set == "walls") near_to(random, wall, 0.02, normal);
        for (int k = 0; k < 3; ++k)
          torque[k] =
              arm[(k + 1) % 3] * normal[(k + 2) % 3] - arm[(k + 2) % 3] * normal[(k + 1) % 3];
        make_unit(torque);
      }
      for (int k = 0; k < 3; ++k) {
        column[k].push_back(float(normal[k]));
        column[3 + k].push_back(float(torque[k]));
      }
      column[6].push_back(float(random.uniform(0.5, 1)));
      column[7].push_back(float(random.uniform(1e-5, 1e-3)));
    }
  }
  static void make_unit(double v[3]) {
    const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; ++k) v[k] /= length;
  }
  // Normally distributed about a pole, `width` along each axis.
  static void near_to(Random& random, const double pole[3], double width, double out[3]) {
    for (int k = 0; k < 3; ++k) {
      const double radius = std::sqrt(-2 * std::log(random.uniform(1e-9, 1)));
      out[k] = pole[k] + width * radius * std::cos(random.uniform(-M_PI, M_PI));
    }
    make_unit(out);
  }
  DirectionsView view(bool weighted) const {
    return {column[0].data(),
            column[1].data(),
            column[2].data(),
            column[3].data(),
            column[4].data(),
            column[5].data(),
            weighted ? column[6].data() : nullptr,
            weighted ? column[7].data() : nullptr,
            weight.size()};
  }
};

enum class Way { tree, sweep, few };

// All ways run on the same contacts, which shows where each begins to pay.
Case make(const std::string& set, std::size_t n, const Rule& rule, Way way) {
  auto c = std::make_shared<Contacts>(set, n, rule);
  const DirectionsView view = c->view(rule.weighted);
  for (std::size_t i = 0; i < n; i += c->step)
    gauss_weights_ref(view, rule.hat, rule.widths, i, i + 1, c->want.data());
  return {
      [=] {
        if (way == Way::few) {
          gauss_weights_few(view, rule.hat, rule.widths, c->weight.data());
        } else if (way == Way::sweep) {
          gauss_weights_sweep(view, rule.hat, rule.widths, c->memory.data(), c->weight.data());
        } else {
          gauss_weights_tree(view, rule.hat, rule.widths, c->memory.data(), c->weight.data());
        }
      },
      [=] { gauss_weights_ref(view, rule.hat, rule.widths, 0, n, c->weight.data()); },
      [=] {
        const float off = n < kGaussMany || rule.hat == Hat::product ? 1e-5f : 1.2e-2f;
        for (std::size_t i = 0; i < n; i += c->step)
          if (!(c->weight[i] >= c->want[i] * (1 - 1e-5f) && c->weight[i] <= c->want[i] * (1 + off)))
            return false;
        return true;
      }};
}

const bool registered = [] {
  for (const Rule& rule : {Rule{"gauss3", Hat::normal, {0.01f, 0.01f}, false},
                           Rule{"gauss6", Hat::sum, {0.01f, 0.01f}, false},
                           Rule{"robust", Hat::product, {0.05f, 1.0f}, true}}) {
    for (const char* set : {"spread", "clump", "walls", "one-normal", "equal"}) {
      for (std::size_t n : {16, 50, 120, 320, 1000, 4000, 10000, 32000, 100000}) {
        const std::string name = std::string(rule.name) + "/" + set + "/n:" + std::to_string(n);
        // The reference takes a minute where contacts are many, and so does the sweep in a clump.
        const bool all = n <= 10000;
        add(
            "kernels/gauss_tree/" + name, n, [=] { return make(set, n, rule, Way::tree); }, all);
        if (all)
          add(
              "kernels/gauss_sweep/" + name, n, [=] { return make(set, n, rule, Way::sweep); },
              false);
        if (n <= kGaussFew)
          add(
              "kernels/gauss_few/" + name, n, [=] { return make(set, n, rule, Way::few); }, false);
      }
    }
  }
  return true;
}();

}  // namespace
