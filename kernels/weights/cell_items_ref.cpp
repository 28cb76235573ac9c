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
                                const CellItems& items, float* part) {
  const Columns column(c.contacts);
  std::size_t count = 0;
  for (std::size_t begin = 0, end; begin < c.contacts.count; begin = end) {
    end = end_of_cell(c, begin);
    const Mean item = join(c, column, widths, begin, end, part);
    if (item.share > 0) {
      for (int k = 0; k < 6; ++k) items.direction[k][count] = item.direction[k];
      items.share[count++] = item.share;
    }
    for (std::size_t i = begin; i < end; ++i) {
      const float alone = (1 - part[i]) * share_of(c, i);
      if (!(alone > 0)) continue;
      for (int k = 0; k < 6; ++k) items.direction[k][count] = column.k[k][i];
      items.share[count++] = alone;
    }
  }
  return count;
}

void weigh_by_items_ref(const CellContacts& c, const float* part, const float* item_share,
                        const float* item_weight, float* weight) {
  std::size_t at = 0;
  const auto density = [&] {
    const float phi = item_share[at] / item_weight[at];
    ++at;
    return phi;
  };
  for (std::size_t begin = 0, end; begin < c.contacts.count; begin = end) {
    end = end_of_cell(c, begin);
    bool joined = false;
    for (std::size_t i = begin; i < end; ++i) joined = joined || part[i] * share_of(c, i) > 0;
    const float of_cell = joined ? density() : 0;
    for (std::size_t i = begin; i < end; ++i) {
      const float share = share_of(c, i);
      const float alone = (1 - part[i]) * share > 0 ? density() : 0;
      weight[i] = share > 0
                      ? c.contacts.facing[i] * share / (part[i] * of_cell + (1 - part[i]) * alone)
                      : 0;
    }
  }
}

}  // namespace h6::kernels
