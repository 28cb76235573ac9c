// SPDX-License-Identifier: Apache-2.0
// cell_items_ref.cpp - the specification of cell_items.h, one contact at a time.
#include "kernels/weights/cell_items.h"

#include <algorithm>

namespace h6::kernels {
namespace {

std::size_t end_of_cell(const CellContacts& c, std::size_t begin) {
  std::size_t i = begin + 1;
  while (i < c.contacts.count && c.cell[i] == c.cell[begin] && c.field[i] == c.field[begin]) ++i;
  return i;
}

struct Columns {
  const float* k[6];
  explicit Columns(const DirectionsView& v) : k{v.nx, v.ny, v.nz, v.tx, v.ty, v.tz} {}
};

struct Mean {
  float direction[6] = {}, share = 0;
  void add(const Columns& column, std::size_t i, float s) {
    share += s;
    for (int k = 0; k < 6; ++k) direction[k] += s * column.k[k][i];
  }
  void divide() {
    for (float& v : direction) v /= share;
  }
};

float share_of(const CellContacts& c, std::size_t i) {
  return c.contacts.facing[i] * c.contacts.depth[i];
}

// Fills part of rows begin..end-1; returns the cell's item.
Mean join(const CellContacts& c, const Columns& column, const GaussWidths& widths,
          std::size_t begin, std::size_t end, float* part) {
  Mean mean, item;
  for (std::size_t i = begin; i < end; ++i) mean.add(column, i, share_of(c, i)), part[i] = 1;
  if (!(mean.share > 0)) return item;
  mean.divide();
  for (std::size_t i = begin; i < end; ++i) {
    float away[2] = {};
    for (int k = 0; k < 6; ++k) {
      const float d = column.k[k][i] - mean.direction[k];
      away[k / 3] += d * d;
    }
    const float x =
        away[0] / (widths.normal * widths.normal) + away[1] / (widths.torque * widths.torque);
    part[i] = std::clamp((kUnlike - x) / (kUnlike - kAlike), 0.0f, 1.0f);
    item.add(column, i, part[i] * share_of(c, i));
  }
  if (item.share > 0) item.divide();
  return item;
}

}  // namespace

std::size_t list_cell_items_ref(const CellContacts& c, const GaussWidths& widths,
                                const CellItems& items, const ItemsOfContacts& of) {
  const Columns column(c.contacts);
  std::size_t count = 0;
  for (std::size_t begin = 0, end; begin < c.contacts.count; begin = end) {
    end = end_of_cell(c, begin);
    const Mean item = join(c, column, widths, begin, end, of.part);
    for (std::size_t i = begin; i < end; ++i) {
      const float alone = (1 - of.part[i]) * share_of(c, i);
      of.own[i] = static_cast<std::int32_t>(count);
      if (!(alone > 0)) continue;
      for (int k = 0; k < 6; ++k) items.direction[k][count] = column.k[k][i];
      items.share[count++] = alone;
    }
    std::fill(of.cell + begin, of.cell + end, static_cast<std::int32_t>(count));
    if (!(item.share > 0)) continue;
    for (int k = 0; k < 6; ++k) items.direction[k][count] = item.direction[k];
    items.share[count++] = item.share;
  }
  return count;
}

void weigh_by_items_ref(const CellContacts& c, const ItemsOfContacts& of, const float* item_share,
                        const float* item_weight, float* weight) {
  const auto density = [&](std::int32_t item) { return item_share[item] / item_weight[item]; };
  for (std::size_t i = 0; i < c.contacts.count; ++i) {
    const float share = share_of(c, i), part = of.part[i];
    weight[i] = 0;
    if (!(share > 0)) continue;
    float phi = 0;
    if (part > 0) phi += part * density(of.cell[i]);
    if (part < 1) phi += (1 - part) * density(of.own[i]);
    weight[i] = c.contacts.facing[i] * share / phi;
  }
}

}  // namespace h6::kernels
