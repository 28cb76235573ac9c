// SPDX-License-Identifier: Apache-2.0
// Halving boxes picks the axis that the specification picks, for any number of boxes.
#include "kernels/bake/box_halves.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "tests/kernels/kernel_test.h"

using namespace h6::kernels;
using h6::kernels::test::on_every_target;
using h6::kernels::test::Random;

TEST_CASE("smallest_halves: the axis of the specification for any count, on every target") {
  on_every_target([](const std::string&) {
    Random random(3);
    std::size_t chosen[3] = {};
    for (std::size_t count = 1; count < 140; ++count) {
      std::vector<ShortBox> boxes(count);
      // Longer along one axis than along another now and then; up to the whole range.
      for (ShortBox& box : boxes)
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t range = (count + k) % 4 == 0 ? ShortBox::kMost : 900;
          const int low = int(random.below(range)),
                    size = int(random.below(range - std::size_t(low)));
          box.least[k] = std::int16_t(low);
          box.least[4 + k] = std::int16_t(-low - size);
          box.least[3] = box.least[7] = 0;
        }
      std::vector<std::uint16_t> order[3];
      for (std::size_t k = 0; k < 3; ++k) {
        order[k].resize(count);
        std::iota(order[k].begin(), order[k].end(), std::uint16_t{0});
        std::sort(order[k].begin(), order[k].end(), [&](std::uint16_t a, std::uint16_t b) {
          return boxes[a].least[k] - boxes[a].least[4 + k] <
                 boxes[b].least[k] - boxes[b].least[4 + k];
        });
      }
      const std::uint16_t* const orders[3] = {order[0].data(), order[1].data(), order[2].data()};
      for (const std::size_t half : {std::size_t{0}, count / 2, count - 1, count}) {
        const std::size_t axis = smallest_halves(boxes.data(), orders, count, half);
        CHECK(axis == smallest_halves_ref(boxes.data(), orders, count, half));
        ++chosen[axis];
      }
    }
    CHECK(std::min({chosen[0], chosen[1], chosen[2]}) > 20);
  });
}

TEST_CASE("smallest_halves: two clumps come apart along the axis between them") {
  on_every_target([](const std::string&) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ShortBox boxes[16] = {};
      std::uint16_t order[3][16];
      for (std::size_t i = 0; i < 16; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
          // Along the other axes the clumps are mixed.
          const int at = k == axis ? int(i / 8 * 12000 + i % 8 * 100) : int(i % 8 * 500);
          boxes[i].least[k] = std::int16_t(at);
          boxes[i].least[4 + k] = std::int16_t(-at - 10);
          order[k][i] = std::uint16_t(k == axis ? i : i % 2 * 8 + i / 2);
        }
      const std::uint16_t* const orders[3] = {order[0], order[1], order[2]};
      CHECK(smallest_halves(boxes, orders, 16, 8) == axis);
    }
  });
}
