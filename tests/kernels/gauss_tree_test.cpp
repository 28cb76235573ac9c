// gauss_tree_test.cpp - the tree gives the weights of the specification, at any number of contacts.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include "kernels/gauss_tree.h"

#include <algorithm>
#include <numeric>
#include <thread>

#include "tests/kernels/kernel_test.h"
#include "tests/support/near.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

constexpr Hat kHats[] = {Hat::normal, Hat::sum, Hat::product};
constexpr GaussWidths kPaper{0.01f, 0.01f}, kRobust{0.05f, 1.0f};
GaussWidths widths_of(Hat hat) { return hat == Hat::product ? kRobust : kPaper; }

// Relative to each weight.
constexpr double kTolerance = 1e-5;

// Columns that start off alignment and are followed by NaN.
struct Contacts {
  Contacts(std::size_t n, std::size_t shift)
      : column{Column(n, shift), Column(n, shift + 1), Column(n, shift),     Column(n, shift + 3),
               Column(n, shift), Column(n, shift + 2), Column(n, shift + 1), Column(n, shift)},
        count(n) {}
  DirectionsView view(bool weighted) {
    return {column[0].begin(),
            column[1].begin(),
            column[2].begin(),
            column[3].begin(),
            column[4].begin(),
            column[5].begin(),
            weighted ? column[6].begin() : nullptr,
            weighted ? column[7].begin() : nullptr,
            count};
  }
  void set(std::size_t i, const double n[3], const double t[3], double facing, double depth) {
    for (int k = 0; k < 3; ++k) column[k][i] = float(n[k]), column[3 + k][i] = float(t[k]);
    column[6][i] = float(facing), column[7][i] = float(depth);
  }
  Column column[8];
  std::size_t count;
};

void make_unit(double v[3]) {
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  for (int k = 0; k < 3; ++k) v[k] /= length;
}

void near_to(Random& random, const double v[3], double width, double out[3]) {
  double noise[3];
  random.direction(noise);
  const double length = width * (random.uniform(0, 1) + random.uniform(0, 1));
  for (int k = 0; k < 3; ++k) out[k] = v[k] + length * noise[k];
  make_unit(out);
}

enum class Set { spread, clump, equal, line, one_normal, two_clusters, walls, arms };
constexpr Set kSets[] = {Set::spread,     Set::clump,        Set::equal, Set::line,
                         Set::one_normal, Set::two_clusters, Set::walls, Set::arms};

// `width`: of the hats over N and T.
Contacts contacts_of(Set set, std::size_t n, GaussWidths width, std::size_t shift = 0) {
  Random random(1000 + static_cast<std::uint64_t>(set));
  Contacts c(n, shift);
  double poles[6][3];
  for (auto& pole : poles) random.direction(pole);
  for (std::size_t i = 0; i < n; ++i) {
    double normal[3], torque[3];
    random.direction(normal);
    random.direction(torque);
    const double angle = random.uniform(-M_PI, M_PI);
    const double circle[3] = {0.6 * std::cos(angle), std::sin(angle), 0.8 * std::cos(angle)};
    switch (set) {
      case Set::spread:
        break;
      case Set::clump:
        near_to(random, poles[0], width.normal, normal);
        near_to(random, poles[1], width.torque, torque);
        break;
      case Set::equal:
        std::copy_n(poles[0], 3, normal);
        std::copy_n(poles[1], 3, torque);
        break;
      case Set::line:
        std::copy_n(circle, 3, normal);
        std::copy_n(circle, 3, torque);
        break;
      case Set::one_normal:
        std::copy_n(poles[0], 3, normal);
        break;
      case Set::two_clusters: {
        // Just within reach of each other.
        double other[3] = {0, 0, 1}, pole[3] = {0, 0, 1};
        if (random.below(2) == 0) pole[0] = 0.97 * width.normal, other[0] = 0.9 * width.torque;
        make_unit(pole), make_unit(other);
        near_to(random, pole, 0.01 * width.normal, normal);
        near_to(random, other, 0.01 * width.torque, torque);
        break;
      }
      case Set::walls:
        near_to(random, poles[i * 6 / n], 0.02, normal);
        break;
      case Set::arms:  // not unit: the length of an arm in T
        near_to(random, poles[i * 6 / n], 0.02, normal);
        for (double& v : torque) v *= random.uniform(0, 1);
        break;
    }
    const double facing = i % 7 == 3 ? 0.0 : std::min(1.0, random.uniform(0, 2));
    c.set(i, normal, torque, facing, i % 11 == 5 ? 0.0 : random.uniform(0, 1e-3));
  }
  return c;
}

std::vector<float> weights(const DirectionsView& c, Hat hat, const GaussWidths& widths) {
  const std::size_t bytes = gauss_tree_bytes(c.count, hat);
  std::vector<unsigned char> memory(bytes + 32, 0xa5);
  Column weight(c.count, 1);
  gauss_weights_tree(c, hat, widths, memory.data() + 16 + c.count % 16, weight.begin());
  CHECK(weight.padding_untouched());
  for (std::size_t k = 0; k < 16; ++k) {
    CHECK(memory[k] == 0xa5);
    if (k >= c.count % 16) CHECK(memory[bytes + 16 + k] == 0xa5);
  }
  return {weight.begin(), weight.begin() + c.count};
}

// Largest error of every `step`th weight.
double worst_error(Contacts& c, Hat hat, const GaussWidths& widths, bool weighted,
                   std::size_t step = 1) {
  const std::vector<float> got = weights(c.view(weighted), hat, widths);
  std::vector<float> want(c.count);
  double worst = 0;
  for (std::size_t i = 0; i < c.count; i += step) {
    gauss_weights_ref(c.view(weighted), hat, widths, i, i + 1, want.data());
    const double error = std::fabs(double{got[i]} - want[i]);
    worst = std::max(worst, want[i] > 0 ? error / want[i] : got[i] == 0 ? 0.0 : HUGE_VAL);
    if (!std::isfinite(got[i])) worst = HUGE_VAL;
  }
  return worst;
}

}  // namespace

TEST_CASE("gauss_tree: weights are those of the reference on every target, count and alignment") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 67; ++n) {
      Contacts c = contacts_of(kSets[n % 8], n, kRobust, n % 5);
      for (Hat hat : kHats) {
        CHECK(worst_error(c, hat, kRobust, true) <= kTolerance);
        CHECK(worst_error(c, hat, kPaper, n % 2 == 0) <= kTolerance);
        CHECK(worst_error(c, hat, {2.0f, 2.0f}, n % 2 == 1) <= kTolerance);
      }
    }
  });
}

TEST_CASE("gauss_tree: weights are right however thousands of contacts lie") {
  on_every_target([](const std::string& target) {
    for (Set set : kSets) {
      for (Hat hat : kHats) {
        // The scalar target computes what the others do, slowly.
        for (std::size_t n : {1000, 5003, 20000}) {
          if (target == "SCALAR" && n > 5003) continue;
          CAPTURE(static_cast<int>(set));
          CAPTURE(static_cast<int>(hat));
          CAPTURE(n);
          const GaussWidths width = widths_of(hat);
          Contacts c = contacts_of(set, n, width, 3);
          CHECK(worst_error(c, hat, width, n != 1000 || hat == Hat::product, n / 40) <= kTolerance);
        }
      }
    }
  });
}

TEST_CASE("gauss_tree: any order of slices, and any threads, give the same bits") {
  for (Hat hat : kHats) {
    Contacts c = contacts_of(Set::walls, 6001, widths_of(hat));
    const std::vector<float> want = weights(c.view(true), hat, widths_of(hat));
    std::vector<float> got(c.count);
    std::vector<char> memory(gauss_tree_bytes(c.count, hat));
    const GaussTree tree = gauss_tree(c.view(true), hat, widths_of(hat), memory.data(), got.data());
    for (const bool threads : {false, true}) {
      std::fill(got.begin(), got.end(), -1.0f);
      for (int stage = 0; stage < kGaussStages; ++stage) {
        const std::size_t slices = gauss_tree_slices(tree, stage);
        const auto odd = [&](std::size_t rest) {
          for (std::size_t i = slices; i-- > 0;)
            if (i % 2 == rest) gauss_tree_run(tree, stage, i);
        };
        if (threads) {
          std::thread other(odd, 1);
          odd(0);
          other.join();
        } else {
          odd(1), odd(0);
        }
      }
      CHECK(same_bits(want.data(), got.data(), got.size()));
    }
  }
}

TEST_CASE("gauss_tree: coincident contacts share one contact's stiffness, whatever their number") {
  on_every_target([](const std::string&) {
    for (std::size_t n : {1u, 17u, 1000u, 70000u}) {
      for (Hat hat : kHats) {
        Contacts c = contacts_of(Set::equal, n, kRobust);
        for (std::size_t i = 0; i < n; ++i) c.column[6][i] = 1, c.column[7][i] = 1e-3f;
        for (const bool weighted : {false, true}) {
          const auto w = weights(c.view(weighted), hat, kRobust);
          CHECK(std::accumulate(w.begin(), w.end(), 0.0) == h6::test::near(1.0).epsilon(1e-5));
        }
      }
    }
  });
}

TEST_CASE("gauss_tree: weights stay within 0 and 1 at any depth and width") {
  Random random(77);
  on_every_target([&](const std::string&) {
    for (float epsilon : {1e-30f, 1e-4f, 0.01f, 2.0f}) {
      for (Set set : {Set::clump, Set::spread, Set::equal}) {
        Contacts c = contacts_of(set, 700, {std::max(epsilon, 1e-4f), std::max(epsilon, 1e-4f)});
        for (std::size_t i = 0; i < c.count; ++i)
          c.column[7][i] = float(std::pow(10.0, random.uniform(-44, 2)));
        for (Hat hat : kHats) {
          for (float w : weights(c.view(true), hat, {epsilon, epsilon})) {
            CHECK(w >= 0.0f);
            CHECK(w <= 1.0f + 1e-5f);
          }
        }
      }
    }
  });
}

TEST_CASE("gauss_tree: contacts that face away weigh nothing, were they all to") {
  Contacts c = contacts_of(Set::clump, 1200, kRobust);
  for (std::size_t i = 0; i < c.count; ++i) c.column[6][i] = 0;
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats)
      for (float w : weights(c.view(true), hat, kRobust)) CHECK(w == 0.0f);
  });
}

TEST_CASE("gauss_tree: columns that are not numbers do no harm outside the weights") {
  Contacts c = contacts_of(Set::walls, 3000, kRobust);
  for (std::size_t i = 0; i < c.count; i += 13)
    c.column[i % 8][i] = i % 2 ? HUGE_VALF : std::numeric_limits<float>::quiet_NaN();
  on_every_target([&](const std::string&) {
    for (Hat hat : kHats) CHECK(weights(c.view(true), hat, kRobust).size() == c.count);
  });
}
