// SPDX-License-Identifier: Apache-2.0
#include "runtime/frame/scratch_memory.h"

#include <algorithm>

#include "runtime/contact/contact_stages.h"
#include "runtime/contact/traverse_pair.h"
#include "runtime/contact/weighing.h"

namespace h6 {
namespace {

kernels::Touching take_touching(Arena& arena, std::size_t rows) {
  kernels::Touching t{};
  t.row = arena.take<std::uint32_t>(rows);
  for (float** column : {&t.distance, &t.gx, &t.gy, &t.gz}) *column = arena.take<float>(rows);
  return t;
}

void take_traversal(TraverseScratch& t, Arena& arena, const ScratchRoom& room) {
  t.capacity = room.contacts + kGroupRows * room.groups;
  t.frontier = arena.take<std::uint32_t>(room.groups);
  t.survivors = arena.take<std::uint32_t>(room.groups);
  t.far = arena.take<std::uint32_t>(room.groups);
  t.far_survivors = arena.take<std::uint32_t>(room.groups);
  t.open_blocks = arena.take<std::uint32_t>(room.blocks);
  t.way_now = arena.take<float>(room.blocks);
  t.way_from = arena.take<float>(room.blocks);
  t.clearance = arena.take<float>(room.groups);
  t.rest = arena.take<float>(room.groups);
  t.reach = arena.take<float>(room.groups);
  t.rows = arena.take<std::uint16_t>(room.groups);
  t.near_rows = arena.take<std::uint16_t>(room.groups);
  t.candidate = arena.take<std::uint32_t>(t.capacity);
  for (float** column :
       {&t.candidate_distance, &t.key, &t.gradient_x, &t.gradient_y, &t.gradient_z})
    *column = arena.take<float>(t.capacity);
  if (room.slices) t.apart = take_touching(arena, kGroupRows * room.groups);
  t.lent = take_search(arena, room.groups, room.blocks);
}

void take_weighing(Scratch& scratch, Arena& arena, const ScratchRoom& room) {
  scratch.cluster = {arena.take<std::uint32_t>(room.merged), arena.take<std::uint32_t>(room.merged),
                     arena.take<std::uint64_t>(room.merged)};
  scratch.weigh = room.weighing ? arena.take<char>(room.weighing) : nullptr;
  scratch.slice_sum = arena.take<kernels::WrenchSum>(room.contacts / kSumSlice + 1);
  FrictionScratch& rub = scratch.friction;
  rub.load = arena.take<float>(room.rubbing);
  rub.stretch = arena.take<double>(room.rubbing);
  for (float*& column : rub.line) column = arena.take<float>(room.rubbing);
  const std::size_t slices = room.rubbing > 0 ? room.contacts / kRubSlice + 1 : 0;
  rub.slice = arena.take<FrictionRows<float>>(slices);
  rub.sums = arena.take<kernels::FrictionSums>(slices);
  rub.K = arena.take<Mat6>(slices);
}

}  // namespace

ScratchRoom scratch_room(const Settings& set, std::size_t groups, std::size_t blocks) {
  ScratchRoom room;
  room.groups = std::max(room.groups, groups);
  room.blocks = std::max(room.blocks, blocks);
  room.contacts = set.max_contacts;
  room.merged = uses_clusters(set.contact) ? set.max_contacts : 0;
  room.rubbing = set.max_contacts * rows_of_contact(set.contact);
  room.weighing = weigh_scratch_bytes(set.contact, set.max_contacts);
  return room;
}

ScratchRoom either(const ScratchRoom& a, const ScratchRoom& b) {
  ScratchRoom room;
  room.groups = std::max(a.groups, b.groups), room.blocks = std::max(a.blocks, b.blocks);
  room.contacts = std::max(a.contacts, b.contacts);
  room.merged = std::max(a.merged, b.merged), room.rubbing = std::max(a.rubbing, b.rubbing);
  room.weighing = std::max(a.weighing, b.weighing);
  room.slices = a.slices || b.slices;
  return room;
}

void lay_out_scratch(Scratch& scratch, Arena& arena, const ScratchRoom& room, bool weighs) {
  scratch.slice_count = arena.take<std::size_t>(room.groups / kTouchSlice + 2);
  // A shell body's candidates have become contacts before these are weighed, so both lie in one
  // place.
  const std::size_t begin = arena.used();
  take_traversal(scratch.traverse, arena, room);
  if (!weighs) return;
  const std::size_t end = arena.used();
  arena.go_back(begin);
  take_weighing(scratch, arena, room);
  arena.go_on(end);
}

SearchColumns take_search(Arena& arena, std::size_t groups, std::size_t blocks) {
  SearchColumns columns;
  columns.block_way = arena.take<float>(blocks);
  columns.group_expiry = arena.take<float>(groups);
  columns.block_expiry = arena.take<float>(blocks);
  columns.near_rows = arena.take<std::uint16_t>(groups);
  columns.rest_expiry = arena.take<float>(groups);
  return columns;
}

}  // namespace h6
