// SPDX-License-Identifier: Apache-2.0
// cell_items.h - fewer items for the density of many contacts on the Gauss map.
//
// Contacts of one cell of a shell that push in one direction are one item, with the mean of their
// directions and the sum of their shares. A contact that deviates from its cell's mean is an item
// of its own, and in between it is a part of both, so the density stays continuous. METHOD.md,
// Sec. 3, "Firm".
#pragma once
#include "kernels/weights/gauss_weights.h"

namespace h6::kernels {

inline constexpr std::size_t kCellMost = 16;  // contacts of a cell at most
// Squares of deviations |dN|^2 / epsilon_N^2 + |dT|^2 / epsilon_T^2: up to the first a contact
// belongs to its cell, from the second on it stands alone.
inline constexpr float kAlike = 1.0f / 4, kUnlike = 1;

// Contacts of one cell follow each other: rows of equal `cell` and `field`. The shares are
// facing * depth of `contacts`, neither of which is null.
struct CellContacts {
  DirectionsView contacts;
  const std::uint32_t* cell;
  const std::int32_t* field;
};
struct CellItems {
  float* direction[6];  // (cell_items_room)
  float* share;         // (cell_items_room), > 0
};
inline constexpr std::size_t cell_items_room(std::size_t contacts) {
  return 2 * contacts + kCellMost;
}
// Says which items each contact is a part of.
struct ItemsOfContacts {
  float* part;         // (contacts) how much of it belongs to its cell's item, in [0, 1]
  std::int32_t* cell;  // (contacts) that item, where part and share are above 0
  std::int32_t* own;   // (contacts) its own item, where part is below 1 and share above 0
};

// Lists the items, cell by cell: first those of its contacts, then its own, where it has one.
// Elsewhere cell and own hold any number from 0 to that of the items. Returns this number.
std::size_t list_cell_items(const CellContacts& c, const GaussWidths& widths,
                            const CellItems& items, const ItemsOfContacts& of);
std::size_t list_cell_items_ref(const CellContacts& c, const GaussWidths& widths,
                                const CellItems& items, const ItemsOfContacts& of);

// weight_i = facing_i share_i / (part_i phi_cell + (1 - part_i) phi_own), phi = share / item_weight
// of the items that list_cell_items wrote; 0 where share_i = 0. The item columns have room for one
// item more.
void weigh_by_items(const CellContacts& c, const ItemsOfContacts& of, const float* item_share,
                    const float* item_weight, float* weight);
void weigh_by_items_ref(const CellContacts& c, const ItemsOfContacts& of, const float* item_share,
                        const float* item_weight, float* weight);

}  // namespace h6::kernels
