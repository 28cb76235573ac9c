// SPDX-License-Identifier: Apache-2.0
// body_boxes.h - boxes of bodies in three flat tiers, to find those that overlap one.
//
//   boxes of 256 bodies  ->  boxes of 16 bodies  ->  boxes of bodies
//
// Bodies that start near each other are neighbours, fixed ones apart from those that move. A box
// that changes changes the two above it. Where moving bodies have mixed, the boxes above them tell
// little, and a search compares all of them.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>

#include "runtime/base/arena.h"
#include "runtime/base/box.h"

namespace h6 {

class BodyBoxes {
 public:
  // Called twice, like every layout: first with an arena that only counts.
  void lay_out(Arena& arena, std::size_t bodies);
  // Takes these boxes over. It sorts the bodies by their centres, those that move behind the
  // others.
  void fill(std::span<const Box> boxes, std::span<const bool> moves);

  const Box& of(std::size_t body) const { return box_[row_[body]]; }
  void set(std::size_t body, const Box& box);
  // Calls f(body) for every body whose box overlaps this one.
  template <class F>
  void each_overlap(const Box& box, F&& f) const {
    for (std::size_t i = 0; i < upper_.size(); ++i) {
      if (!overlap(upper_[i], box)) continue;
      for (std::size_t k = kFan * i; k < std::min(kFan * (i + 1), middle_.size()); ++k) {
        if (!overlap(middle_[k], box)) continue;
        for (std::size_t row = kFan * k; row < kFan * (k + 1); ++row)
          if (overlap(box_[row], box)) f(body_[row]);
      }
    }
  }

 private:
  static constexpr std::size_t kFan = 16;
  std::span<Box> box_, middle_, upper_;  // `box_`: whole sixteens; rows without a body are empty
  std::span<std::uint32_t> row_, body_;  // (bodies), (rows)
};

}  // namespace h6
