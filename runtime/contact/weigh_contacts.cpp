// SPDX-License-Identifier: Apache-2.0
// weigh_contacts.cpp - how the contact stiffness is shared among a shell body's contacts.
//
// The rules are those of Xu & Barbic 2016, Eq. (6)-(12), and of McNeely 1999 for `global`; `robust`
// is our own. METHOD.md, Sec. 3, settles the paper's ambiguities: w_i = phi_self / phi_i.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels/weights/cell_items.h"
#include "kernels/weights/gauss_few.h"
#include "kernels/weights/gauss_memory.h"
#include "kernels/weights/gauss_sweep.h"
#include "kernels/weights/gauss_tree.h"
#include "runtime/contact/contact_stages.h"
#include "runtime/contact/weighing.h"

namespace h6 {
namespace {

// From this many contacts on, and for more than two threads, a density is cut into slices. With
// fewer, each thread computes one of the two densities from the sorting on, so its data stay in its
// own cache and it waits only once.
constexpr std::size_t kWorthSlicing = 4096;
// Up to this many contacts, all pairs of contacts are compared without sorting: 120 take 1.7 us so,
// and 1.9 to 3.3 us with sorting.
constexpr std::size_t kWorthSorting = 120;
constexpr float kFacingEdge = 0.25f;     // N.g from which a contact counts in full
constexpr std::size_t kRowSlice = 1024;  // rows of which simple columns are filled at a time

struct Rule {
  bool gauss = false, facing = false, depth = false, handles = false, printed = false;
  kernels::Hat hat = kernels::Hat::normal;
  kernels::GaussWidths widths{};
  float l0 = 0;
};

Rule rule_of(const h6ContactDef& def, double voxel) {
  Rule rule;
  rule.facing = def.pieces & H6_PIECE_FACING;
  rule.depth = def.pieces & H6_PIECE_DEPTH;
  rule.l0 = static_cast<float>(def.torque_length);
  rule.widths = {static_cast<float>(def.epsilon), static_cast<float>(def.epsilon)};
  rule.handles = def.pieces & H6_PIECE_HANDLES;
  rule.printed = def.pieces & H6_PIECE_PRINTED;
  switch (def.method) {
    case H6_METHOD_GAUSS3:
      rule.gauss = true;
      break;
    case H6_METHOD_GAUSS6:
      rule.gauss = true;
      rule.hat = def.pieces & H6_PIECE_PRODUCT ? kernels::Hat::product : kernels::Hat::sum;
      break;
    case H6_METHOD_ROBUST:
    case H6_METHOD_FIRM:
      rule.gauss = rule.facing = rule.depth = true;
      rule.hat = kernels::Hat::product;
      rule.widths = {static_cast<float>(def.epsilon_normal),
                     static_cast<float>(def.epsilon_torque)};
      rule.l0 = static_cast<float>(def.torque_length > 0 ? def.torque_length : voxel);
      break;
    default:
      break;
  }
  rule.widths.geodesic = def.pieces & H6_PIECE_GEODESIC;
  return rule;
}

// Eq. (8) as printed: phi_i over the largest phi. The weights have been divided by their phi.
void weigh_as_printed(Contacts& c, const Rule& rule) {
  const float self = rule.hat == kernels::Hat::sum ? 2.0f : 1.0f;
  float most = 0;
  for (std::size_t i = 0; i < c.count; ++i) {
    if (!(c.weight[i] > 0)) continue;
    c.load[i] = c.facing[i] * c.facing[i] * (rule.depth ? c.depth[i] : 1.0f) * self / c.weight[i];
    most = std::max(most, c.load[i]);
  }
  for (std::size_t i = 0; i < c.count; ++i)
    if (c.weight[i] > 0) c.weight[i] = c.facing[i] * c.load[i] / most;
}

// clamp(N.g / 0.25, 0, 1), or 1 without the filter.
void fill_facing(const Contacts& c, bool filter, std::size_t begin, std::size_t end,
                 float* facing) {
  if (filter)
    return kernels::contact_facing(kernel_columns(c, begin, end), kFacingEdge, facing + begin);
  std::fill(facing + begin, facing + end, 1.0f);
}

// Calls run(begin, end) for slices of all rows.
template <class Run>
void for_rows(const Contacts& c, sched::FrameTeam* team, const Run& run) {
  for_slices((c.count + kRowSlice - 1) / kRowSlice, team,
             [&](std::size_t i) { run(i * kRowSlice, std::min((i + 1) * kRowSlice, c.count)); });
}

void fill_torque_directions(const Contacts& c, const Rule& rule, double lever, std::size_t begin,
                            std::size_t end) {
  kernels::torque_directions(kernel_columns(c, begin, end), rule.l0,
                             rule.handles ? static_cast<float>(lever) : 0.0f, c.tx + begin,
                             c.ty + begin, c.tz + begin);
}

void weigh_with_tree(const kernels::DirectionsView& view, const Rule& rule, sched::FrameTeam* team,
                     void* scratch, float* weight) {
  const kernels::GaussTree tree = kernels::gauss_tree(view, rule.hat, rule.widths, scratch, weight);
  for (int stage = 0; stage < kernels::kGaussStages; ++stage)
    for_slices(kernels::gauss_tree_slices(tree, stage), team,
               [&](std::size_t i) { kernels::gauss_tree_run(tree, stage, i); });
}

// If contacts crowd so much that the tree is faster, returns false and weighs nothing.
bool weigh_with_sweep(const kernels::DirectionsView& view, const Rule& rule, sched::FrameTeam* team,
                      void* scratch, float* weight) {
  if (view.count > kernels::kGaussSweepMost && !rule.widths.geodesic) return false;
  const kernels::GaussSweep sweep =
      kernels::gauss_sweep(view, rule.hat, rule.widths, scratch, weight);
  int stage = 0;
  const bool few = view.count < kWorthSlicing && !(team && team->threads() > 2);
  if (sweep.densities == 2 && few) {
    const std::size_t slices = kernels::gauss_sweep_slices(sweep, 1) / 2;
    for_slices(2, team, [&](std::size_t density) {
      kernels::gauss_sweep_run(sweep, 0, density);
      for (std::size_t i = 0; i < slices; ++i)
        kernels::gauss_sweep_run(sweep, 1, density * slices + i);
    });
    if (!kernels::gauss_sweep_pays(sweep)) return false;
    stage = 2;
  }
  for (; stage < kernels::kGaussSweepStages; ++stage) {
    if (stage == 1 && !kernels::gauss_sweep_pays(sweep)) return false;
    for_slices(kernels::gauss_sweep_slices(sweep, stage), team,
               [&](std::size_t i) { kernels::gauss_sweep_run(sweep, stage, i); });
  }
  return true;
}

void weigh_view(const kernels::DirectionsView& view, const Rule& rule, sched::FrameTeam* team,
                void* scratch, float* weight) {
  if (view.count <= kWorthSorting)
    kernels::gauss_weights_few(view, rule.hat, rule.widths, weight);
  else if (!weigh_with_sweep(view, rule, team, scratch, weight))
    weigh_with_tree(view, rule, team, scratch, weight);
}

void weigh_gauss(Contacts& c, const Rule& rule, sched::FrameTeam* team, void* scratch) {
  weigh_view({c.nx, c.ny, c.nz, c.tx, c.ty, c.tz, rule.facing ? c.facing : nullptr,
              rule.depth ? c.depth : nullptr, c.count},
             rule, team, scratch, c.weight);
  if (rule.printed) weigh_as_printed(c, rule);
}

struct Items {
  kernels::CellItems column{};
  float* weight = nullptr;
  kernels::ItemsOfContacts of{};
  kernels::CellItems from(std::size_t row) const {
    kernels::CellItems items = column;
    for (float*& direction : items.direction) direction += row;
    items.share += row;
    return items;
  }
  kernels::ItemsOfContacts of_contacts(std::size_t row) const {
    return {of.part + row, of.cell + row, of.own + row};
  }
};

constexpr std::size_t kLeastCells = 1024;  // contacts of a slice of cells, listed in some 9 us
constexpr std::size_t kMostSlices = 32;
static_assert(kGroupRows <= kernels::kCellMost);  // a cell lies in one group

// Between the items of two slices there is room for the whole vectors that the first one stores.
std::size_t items_room(std::size_t contacts) {
  return kernels::cell_items_room(contacts) +
         std::min(kMostSlices, contacts / kLeastCells) * kernels::kCellMost;
}

Items take_items(kernels::GaussColumns& columns, std::size_t contacts) {
  const std::size_t room = items_room(contacts);
  Items items;
  for (float*& column : items.column.direction) columns.take(column, room);
  columns.take(items.column.share, room);
  columns.take(items.weight, room);
  columns.take(items.of.part, contacts);
  columns.take(items.of.cell, contacts);
  columns.take(items.of.own, contacts);
  return items;
}

kernels::CellContacts cells_between(const Contacts& c, std::size_t begin, std::size_t end) {
  return {{c.nx + begin, c.ny + begin, c.nz + begin, c.tx + begin, c.ty + begin, c.tz + begin,
           c.facing + begin, c.slack + begin, end - begin},
          c.cell + begin,
          c.field_body + begin};
}

// Slices of contacts, none of which ends within a cell, and the items of each.
struct CellSlices {
  std::size_t count = 0;
  std::size_t begin[kMostSlices + 1] = {};  // first contact; at `count` the number of contacts
  std::size_t item[kMostSlices + 1] = {};   // first item, once items follow one another
};

CellSlices slice_cells(const Contacts& c) {
  CellSlices slices;
  const std::size_t each = std::max(kLeastCells, (c.count + kMostSlices - 1) / kMostSlices);
  const auto in_a_cell = [&](std::size_t i) {
    return c.cell[i] == c.cell[i - 1] && c.field_body[i] == c.field_body[i - 1];
  };
  for (std::size_t end = 0; end < c.count; slices.begin[slices.count] = end) {
    end = std::min(end + each, c.count);
    while (end < c.count && in_a_cell(end)) ++end;
    ++slices.count;
  }
  return slices;
}

// Lists the items of all slices, one after the other.
CellSlices list_items(const Contacts& c, const Rule& rule, const Items& items,
                      sched::FrameTeam* team) {
  CellSlices slices = slice_cells(c);
  std::size_t found[kMostSlices];
  // Slices that run in order can write each behind the last one's items; others need room.
  const auto first = [&](std::size_t i) {
    return team ? 2 * slices.begin[i] + i * kernels::kCellMost : slices.item[i];
  };
  for_slices(slices.count, team, [&](std::size_t i) {
    const std::size_t begin = slices.begin[i], end = slices.begin[i + 1];
    fill_torque_directions(c, rule, 0, begin, end);
    found[i] = kernels::list_cell_items(cells_between(c, begin, end), rule.widths,
                                        items.from(first(i)), items.of_contacts(begin));
    if (!team) slices.item[i + 1] = slices.item[i] + found[i];
  });
  for (std::size_t i = 0; team && i < slices.count; ++i) {
    const kernels::CellItems from = items.from(first(i)), to = items.from(slices.item[i]);
    for (int k = 0; k < 6; ++k)
      std::memmove(to.direction[k], from.direction[k], found[i] * sizeof *from.share);
    std::memmove(to.share, from.share, found[i] * sizeof *from.share);
    slices.item[i + 1] = slices.item[i] + found[i];
  }
  return slices;
}

// `firm`: c.slack holds how much each contact counts, c.kappa the stiffness of its direction. Fills
// T, and weight with the share of that stiffness.
void weigh_cells(Contacts& c, const Rule& rule, sched::FrameTeam* team, void* scratch) {
  if (!c.cell) {
    for_rows(c, team, [&](std::size_t begin, std::size_t end) {
      fill_torque_directions(c, rule, 0, begin, end);
    });
    weigh_view({c.nx, c.ny, c.nz, c.tx, c.ty, c.tz, c.facing, c.slack, c.count}, rule, team,
               scratch, c.weight);
    for (std::size_t i = 0; i < c.count; ++i) c.weight[i] *= c.kappa[i];
    return;
  }
  kernels::GaussColumns columns = kernels::GaussColumns::in(scratch);
  const Items items = take_items(columns, c.count);
  const CellSlices slices = list_items(c, rule, items, team);
  const auto& d = items.column.direction;
  weigh_view(
      {d[0], d[1], d[2], d[3], d[4], d[5], nullptr, items.column.share, slices.item[slices.count]},
      rule, team, columns.at + columns.used, items.weight);
  for_slices(slices.count, team, [&](std::size_t i) {
    const std::size_t begin = slices.begin[i], end = slices.begin[i + 1], item = slices.item[i];
    kernels::weigh_by_items(cells_between(c, begin, end), items.of_contacts(begin),
                            items.column.share + item, items.weight + item, c.weight + begin);
    for (std::size_t k = begin; k < end; ++k) c.weight[k] *= c.kappa[k];
  });
}

// Clusters never mix fields: a merged contact belongs to one pair.
void merge_clusters(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                    const ClusterScratch& scratch) {
  Contacts& c = shell.contacts;
  std::size_t out = 0;
  for (Pair& pair : shell.pairs) {
    const double distance = set.contact.cluster_voxels * bodies[pair.b].field->voxel;
    const std::size_t end = cluster_contacts(c, pair.begin, pair.end, out, distance, scratch);
    pair.begin = out;
    pair.end = out = end;
  }
  c.count = out;
}

}  // namespace

std::size_t weigh_scratch_bytes(const h6ContactDef& def, std::size_t count) {
  const Rule rule = rule_of(def, 1.0);
  if (!rule.gauss) return 0;
  kernels::GaussColumns items{nullptr};
  const bool firm = def.method == H6_METHOD_FIRM;
  if (firm) take_items(items, count);
  const std::size_t rows = firm ? kernels::cell_items_room(count) : count;
  return items.block_bytes() + std::max(kernels::gauss_tree_bytes(rows, rule.hat),
                                        kernels::gauss_sweep_bytes(rows, rule.hat));
}

void weigh_columns(Contacts& c, const h6ContactDef& def, double voxel, double lever,
                   sched::FrameTeam* team, void* scratch) {
  const Rule rule = rule_of(def, voxel);
  for_rows(c, team, [&](std::size_t begin, std::size_t end) {
    fill_facing(c, rule.facing, begin, end, c.facing);
    fill_torque_directions(c, rule, lever, begin, end);
  });
  if (rule.gauss) {
    weigh_gauss(c, rule, team, scratch);
  } else {
    const double n = static_cast<double>(c.count);
    const float w = def.method == H6_METHOD_GLOBAL && n > def.global_n0
                        ? static_cast<float>(def.global_n0 / n)
                        : 1.0f;
    for (std::size_t i = 0; i < c.count; ++i) c.weight[i] = w * c.facing[i];
  }
  for (std::size_t i = 0; i < c.count; ++i) c.load[i] = c.weight[i] * c.depth[i];
}

void fill_inner_stiffness(Contacts& c, const h6ContactDef& def, double voxel,
                          sched::FrameTeam* team, void* scratch) {
  if (def.method == H6_METHOD_SERIES) return fill_facing(c, true, 0, c.count, c.weight);
  weigh_cells(c, rule_of(def, voxel), team, scratch);
}

sched::FrameTeam* weighing_team(std::size_t count, Lane& lane) {
  return lane.team->threads() > 1 && lane.weighing.share(count) ? lane.team : nullptr;
}

void weigh_contacts(const Settings& set, std::span<const Body> bodies, ShellBody& shell,
                    Lane& lane) {
  if (uses_series(set.contact)) return weigh_series(set, bodies, shell, lane);
  Contacts& c = shell.contacts;
  if (c.count == 0) return;
  if (uses_clusters(set.contact)) merge_clusters(set, bodies, shell, lane.scratch->cluster);
  const Body& body = bodies[shell.body];
  weigh_columns(c, set.contact, body.voxel, series_lever(body.radius, body.voxel),
                weighing_team(c.count, lane), lane.scratch->weigh);
}

}  // namespace h6
