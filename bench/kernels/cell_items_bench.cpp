// SPDX-License-Identifier: Apache-2.0
// cell_items_bench.cpp - times the list of items of n contacts, and the weights of the contacts
// from those of the items. Cells have 1 to 16 contacts, half of them one.
#include "kernels/weights/cell_items.h"

#include <memory>
#include <vector>

#include "bench/kernels/kernel_bench.h"

namespace {

using namespace h6::kernels;
using namespace h6::kernels::bench;

constexpr GaussWidths kWidths{0.3f, 0.3f};

// In one cell of six the directions spread, so that some of its contacts stand alone.
struct Cells {
  std::vector<float> column[8];  // N, T, facing, share
  std::vector<std::uint32_t> cell;
  std::vector<std::int32_t> field;
  std::vector<float> item[7], item_weight, part, weight, want_item[7], want_part, want_weight;
  std::vector<std::int32_t> of_cell, own, want_of_cell, want_own;
  std::size_t items = 0, want_items = 0;

  explicit Cells(std::size_t n) : field(n, 0) {
    Random random(7);
    for (std::uint32_t id = 0; cell.size() < n; ++id) add_cell(random, id, n);
    for (auto* columns : {&item, &want_item})
      for (auto& c : *columns) c.resize(cell_items_room(n));
    item_weight.resize(cell_items_room(n), 0.5f);
    for (auto* rows : {&of_cell, &own, &want_of_cell, &want_own}) rows->resize(n);
    for (auto* rows : {&part, &weight, &want_part, &want_weight}) rows->resize(n);
    want_items = list_cell_items_ref(view(), kWidths, items_in(want_item), wanted());
    weigh_by_items_ref(view(), wanted(), want_item[6].data(), item_weight.data(),
                       want_weight.data());
  }
  void add_cell(Random& random, std::uint32_t id, std::size_t n) {
    const double kind = random.uniform(0, 1);
    const double most = kind < 0.4 ? 1 : kind < 0.8 ? 4 : 16;
    const auto size = static_cast<std::size_t>(random.uniform(1, most + 1));
    const double spread = random.uniform(0, 6) < 1 ? 0.3 : 0.02;
    double axis[6];
    random.direction(axis), random.direction(axis + 3);
    for (std::size_t i = 0; i < size && cell.size() < n; ++i) {
      cell.push_back(id);
      for (int k = 0; k < 6; ++k)
        column[k].push_back(static_cast<float>(axis[k] + random.uniform(-spread, spread)));
      column[6].push_back(static_cast<float>(random.uniform(0.5, 1)));
      column[7].push_back(static_cast<float>(random.uniform(0.01, 0.1)));
    }
  }
  CellContacts view() const {
    const auto p = [&](int k) { return column[k].data(); };
    return {
        {p(0), p(1), p(2), p(3), p(4), p(5), p(6), p(7), cell.size()}, cell.data(), field.data()};
  }
  ItemsOfContacts listed() { return {part.data(), of_cell.data(), own.data()}; }
  ItemsOfContacts wanted() { return {want_part.data(), want_of_cell.data(), want_own.data()}; }
  static CellItems items_in(std::vector<float> (&to)[7]) {
    CellItems items{};
    for (int k = 0; k < 6; ++k) items.direction[k] = to[k].data();
    items.share = to[6].data();
    return items;
  }
};

bool near(const std::vector<float>& a, const std::vector<float>& b, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!(std::fabs(a[i] - b[i]) <= 1e-4f)) return false;
  return true;
}

Case make_listing(std::size_t n) {
  auto c = std::make_shared<Cells>(n);
  const auto with = [c](auto&& list) {
    c->items = list(c->view(), kWidths, Cells::items_in(c->item), c->listed());
  };
  return {[=] { with([](auto&&... a) { return list_cell_items(a...); }); },
          [=] { with([](auto&&... a) { return list_cell_items_ref(a...); }); },
          [=] {
            bool right = c->items == c->want_items && near(c->part, c->want_part, n);
            for (int k = 0; k < 7; ++k) right &= near(c->item[k], c->want_item[k], c->items);
            return right;
          }};
}

Case make_weighing(std::size_t n) {
  auto c = std::make_shared<Cells>(n);
  const auto with = [c](auto&& weigh) {
    weigh(c->view(), c->wanted(), c->want_item[6].data(), c->item_weight.data(), c->weight.data());
  };
  return {[=] { with([](auto&&... a) { weigh_by_items(a...); }); },
          [=] { with([](auto&&... a) { weigh_by_items_ref(a...); }); },
          [=] { return near(c->weight, c->want_weight, n); }};
}

[[maybe_unused]] const bool registered = [] {
  for (std::size_t n : {100, 1000, 10000}) {
    const std::string rest = "/n:" + std::to_string(n);
    add("kernels/list_cell_items" + rest, n, [=] { return make_listing(n); });
    add("kernels/weigh_by_items" + rest, n, [=] { return make_weighing(n); });
  }
  return true;
}();

}  // namespace
