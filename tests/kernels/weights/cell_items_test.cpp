// SPDX-License-Identifier: Apache-2.0
// cell_items_test.cpp - contacts of a cell joined to items of the density, and their weights.
#include "kernels/weights/cell_items.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using namespace h6::kernels::test;

namespace {

constexpr GaussWidths kWidths{0.05f, 1.0f};

// Cells of up to 16 contacts whose directions deviate by up to `spread` epsilons.
struct Cells {
  std::vector<Column> column;  // N T facing depth
  std::vector<std::uint32_t> cell;
  std::vector<std::int32_t> field;
  Cells(std::size_t n, double spread, std::size_t shift = 0) : cell(n), field(n) {
    Random random(90 + n);
    for (std::size_t k = 0; k < 8; ++k) column.emplace_back(n, shift + k % 3);
    double normal[3] = {}, torque[3] = {}, away[3];
    std::uint32_t number = 0;
    for (std::size_t i = 0, left = 0; i < n; ++i, --left) {
      if (left == 0) {
        left = 1 + random.below(16), ++number;
        random.direction(normal), random.direction(torque);
      }
      cell[i] = number;
      field[i] = i < n / 2 ? 3 : 4;  // one cell may meet two fields
      random.direction(away);
      for (std::size_t k = 0; k < 3; ++k)
        column[k][i] = float(normal[k] + spread * 0.05 * random.uniform(0, 1) * away[k]);
      random.direction(away);
      for (std::size_t k = 0; k < 3; ++k)
        column[3 + k][i] = float(torque[k] + spread * random.uniform(0, 1) * away[k]);
      column[6][i] = i % 7 == 2 ? 0.0f : float(random.uniform(0, 1));
      column[7][i] = i % 11 == 3 ? 0.0f : float(random.uniform(0, 1e-3));
    }
  }
  CellContacts view() {
    const auto p = [&](std::size_t k) { return column[k].begin(); };
    return {
        {p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7), cell.size()}, cell.data(), field.data()};
  }
};

struct Items {
  std::vector<std::vector<float>> column;  // N T share
  std::vector<float> part, weight;
  std::vector<std::int32_t> cell, own;
  std::size_t count = 0;
  template <class List>
  Items(Cells& c, const List& list)
      : part(c.cell.size(), -1), cell(c.cell.size(), -1), own(c.cell.size(), -1) {
    column.assign(7, std::vector<float>(cell_items_room(c.cell.size())));
    CellItems items{{}, column[6].data()};
    for (std::size_t k = 0; k < 6; ++k) items.direction[k] = column[k].data();
    count = list(c.view(), kWidths, items, of_contacts());
  }
  ItemsOfContacts of_contacts() { return {part.data(), cell.data(), own.data()}; }
  // Weights whose items have the densities of the specification.
  template <class Weigh>
  void weigh(Cells& c, const Weigh& by_items) {
    std::vector<float> of_item(count + 1);
    gauss_weights_ref({column[0].data(), column[1].data(), column[2].data(), column[3].data(),
                       column[4].data(), column[5].data(), nullptr, column[6].data(), count},
                      Hat::product, kWidths, 0, count, of_item.data());
    weight.assign(c.cell.size(), -1);
    by_items(c.view(), of_contacts(), column[6].data(), of_item.data(), weight.data());
  }
};

std::vector<float> exact_weights(Cells& c) {
  std::vector<float> w(c.cell.size());
  gauss_weights_ref(c.view().contacts, Hat::product, kWidths, 0, w.size(), w.data());
  return w;
}

}  // namespace

TEST_CASE("cell_items: SIMD lists the reference's items and weights on every target and count") {
  on_every_target([](const std::string&) {
    for (std::size_t n = 0; n <= 150; n += n < 67 ? 1 : 17) {
      CAPTURE(n);
      for (const double spread : {0.0, 0.2, 0.6}) {
        Cells c(n, spread, n % 4);
        Items got(c, list_cell_items), want(c, list_cell_items_ref);
        REQUIRE(got.count == want.count);
        for (std::size_t i = 0; i < n; ++i) {
          REQUIRE(got.part[i] == doctest::Approx(want.part[i]).epsilon(1e-4));
          CHECK(got.part[i] >= 0);
          CHECK(got.part[i] <= 1);
          for (const std::int32_t item : {got.cell[i], got.own[i]}) {
            CHECK(item >= 0);
            CHECK(std::size_t(item) <= got.count);
          }
          if (!(c.column[6][i] * c.column[7][i] > 0)) continue;
          if (got.part[i] > 0) CHECK(got.cell[i] == want.cell[i]);
          if (got.part[i] < 1) CHECK(got.own[i] == want.own[i]);
        }
        for (std::size_t k = 0; k < 7; ++k)
          for (std::size_t i = 0; i < got.count; ++i)
            CHECK(got.column[k][i] == doctest::Approx(want.column[k][i]).epsilon(1e-4));
        got.weigh(c, weigh_by_items), want.weigh(c, weigh_by_items_ref);
        for (std::size_t i = 0; i < n; ++i)
          CHECK(got.weight[i] == doctest::Approx(want.weight[i]).epsilon(1e-3));
      }
    }
  });
}

TEST_CASE("cell_items: contacts of equal directions are one item and keep their exact weights") {
  Cells c(500, 0);
  Items items(c, list_cell_items);
  CHECK(items.count < 120);
  items.weigh(c, weigh_by_items);
  const std::vector<float> exact = exact_weights(c);
  for (std::size_t i = 0; i < 500; ++i)
    CHECK(items.weight[i] == doctest::Approx(exact[i]).epsilon(1e-4));
}

TEST_CASE("cell_items: contacts that differ from their cell by epsilon keep their exact weights") {
  Cells c(300, 0);
  // Alternate contacts face two ways, each an epsilon from the mean.
  for (std::size_t i = 0; i < 300; ++i) c.column[0][i] += i % 2 ? 0.06f : -0.06f;
  Items items(c, list_cell_items);
  items.weigh(c, weigh_by_items);
  const std::vector<float> exact = exact_weights(c);
  int compared = 0;
  for (std::size_t i = 0; i < 300; ++i) {
    if (items.part[i] > 0) continue;
    ++compared;
    CHECK(items.weight[i] == doctest::Approx(exact[i]).epsilon(0.02));
  }
  CHECK(compared > 150);
}

TEST_CASE("cell_items: the item of a contact that hardly stands alone has its direction") {
  on_every_target([](const std::string&) {
    int seen = 0;
    for (int step = 0; step < 400; ++step) {
      Cells c(16, 0);
      std::fill(c.cell.begin(), c.cell.end(), 1u);
      std::fill(c.field.begin(), c.field.end(), 3);
      for (std::size_t i = 0; i < 16; ++i) {
        for (std::size_t k = 0; k < 6; ++k) c.column[k][i] = c.column[k][0];
        c.column[6][i] = 1, c.column[7][i] = 5e-4f;
      }
      // Half an epsilon from the mean it begins to stand alone.
      c.column[1][5] += 0.026666f + 1e-8f * float(step);
      Items items(c, list_cell_items);
      if (items.part[5] == 1) continue;
      ++seen;
      const auto own = std::size_t(items.own[5]);
      for (std::size_t k = 0; k < 6; ++k)
        CHECK(items.column[k][own] == doctest::Approx(c.column[k][5]).epsilon(1e-5));
    }
    CHECK(seen > 10);
  });
}

TEST_CASE("cell_items: a weight changes by little however one contact's direction moves on") {
  float last = -1, largest = 0, first = -1, exact = 0, steepest = 0;
  for (int step = 0; step <= 2000; ++step) {
    Cells c(16, 0.05);
    std::fill(c.cell.begin(), c.cell.end(), 1u);
    std::fill(c.field.begin(), c.field.end(), 3);
    for (std::size_t i = 1; i < 16; ++i)
      for (std::size_t k = 0; k < 6; ++k) c.column[k][i] = c.column[k][0];
    for (std::size_t i = 0; i < 16; ++i) c.column[6][i] = 1, c.column[7][i] = 5e-4f;
    c.column[1][5] += 1e-4f * float(step);  // up to four epsilons
    Items items(c, list_cell_items);
    items.weigh(c, weigh_by_items);
    if (step == 0) first = items.weight[5];
    if (last >= 0) largest = std::max(largest, std::fabs(items.weight[5] - last));
    last = items.weight[5];
    const float now = exact_weights(c)[5];
    if (step > 0) steepest = std::max(steepest, std::fabs(now - exact));
    exact = now;
  }
  CHECK(first == doctest::Approx(1.0 / 16));
  CHECK(last == doctest::Approx(1));
  // The weight is steep where it leaves the last of the others, by any rule.
  MESSAGE("largest step " << largest << ", of the exact weights " << steepest);
  CHECK(largest < 2 * steepest);
}
