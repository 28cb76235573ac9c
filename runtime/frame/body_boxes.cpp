// SPDX-License-Identifier: Apache-2.0
// body_boxes.cpp - the order of bodies, and upper boxes that follow the lower ones.
#include "runtime/frame/body_boxes.h"
#include "sched/host_memory.h"

#include <algorithm>
#include <new>

namespace h6 {
namespace {

// Splits bodies at medians of the longest axis into parts of `unit`; only the last part may be
// smaller. Ties go by number, so that the order does not depend on the library.
void split_bodies(std::span<const Vec3> centre, std::span<std::uint32_t> bodies, std::size_t unit) {
  if (bodies.size() <= unit) return;
  Box around;
  for (const std::uint32_t i : bodies) around = united(around, {centre[i], centre[i]});
  Eigen::Index axis;
  (around.high - around.low).maxCoeff(&axis);
  const std::size_t middle = ((bodies.size() + unit - 1) / unit) / 2 * unit;
  std::nth_element(bodies.begin(), bodies.begin() + static_cast<std::ptrdiff_t>(middle),
                   bodies.end(), [&](std::uint32_t a, std::uint32_t b) {
                     return centre[a][axis] != centre[b][axis] ? centre[a][axis] < centre[b][axis]
                                                               : a < b;
                   });
  split_bodies(centre, bodies.first(middle), unit);
  split_bodies(centre, bodies.subspan(middle), unit);
}

Box around_all(std::span<const Box> boxes) {
  Box all;
  for (const Box& box : boxes) all = united(all, box);
  return all;
}

}  // namespace

void BodyBoxes::lay_out(Arena& arena, std::size_t bodies) {
  // Both kinds of bodies may end with an incomplete sixteen.
  const std::size_t middle = (bodies + kFan - 1) / kFan + 1, upper = (middle + kFan - 1) / kFan;
  box_ = {arena.take<Box>(kFan * middle), kFan * middle};
  middle_ = {arena.take<Box>(middle), middle};
  upper_ = {arena.take<Box>(upper), upper};
  row_ = {arena.take<std::uint32_t>(bodies), bodies};
  body_ = {arena.take<std::uint32_t>(kFan * middle), kFan * middle};
}

void BodyBoxes::fill(std::span<const Box> boxes, std::span<const bool> moves) {
  for (const std::span<Box> tier : {box_, middle_, upper_})
    for (Box& box : tier) new (&box) Box();
  sched::HostVector<Vec3> centre;
  for (const Box& box : boxes)
    centre.push_back(box.empty() ? Vec3(Vec3::Zero()) : Vec3(0.5 * (box.low + box.high)));
  std::size_t row = 0;
  for (const bool moving : {false, true}) {
    sched::HostVector<std::uint32_t> bodies;
    for (std::size_t i = 0; i < boxes.size(); ++i)
      if (moves[i] == moving) bodies.push_back(static_cast<std::uint32_t>(i));
    split_bodies(centre, bodies, kFan * kFan);
    for (std::size_t at = 0; at < bodies.size(); at += kFan * kFan)
      split_bodies(centre, std::span(bodies).subspan(at, std::min(kFan * kFan, bodies.size() - at)),
                   kFan);
    for (const std::uint32_t body : bodies) {
      body_[row] = body;
      row_[body] = static_cast<std::uint32_t>(row++);
    }
    row = (row + kFan - 1) / kFan * kFan;
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) box_[row_[i]] = boxes[i];
  for (std::size_t i = 0; i < boxes.size(); ++i) set(i, boxes[i]);
}

void BodyBoxes::set(std::size_t body, const Box& box) {
  const std::size_t row = row_[body], middle = row / kFan, first = middle / kFan * kFan;
  box_[row] = box;
  middle_[middle] = around_all(box_.subspan(kFan * middle, kFan));
  upper_[middle / kFan] =
      around_all(middle_.subspan(first, std::min(kFan, middle_.size() - first)));
}

}  // namespace h6
