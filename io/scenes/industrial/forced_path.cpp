// SPDX-License-Identifier: Apache-2.0
#include "io/scenes/industrial/forced_path.h"

#include <cmath>
#include <numbers>
#include <random>

#include "io/scenes/shapes.h"

namespace h6::io {
namespace {

double random_share(std::mt19937_64& engine) {  // [0, 1)
  return static_cast<double>(engine() >> 11) * 0x1p-53;
}

h6Vec3 in_unit_ball(std::mt19937_64& engine) {
  const double z = 2 * random_share(engine) - 1;
  const double angle = 2 * std::numbers::pi * random_share(engine);
  const double r = std::sqrt(1 - z * z), size = std::cbrt(random_share(engine));
  return size * h6Vec3{r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace

Path forced_path(const Path& way_in, std::size_t index, const Pulls& pulls) {
  std::mt19937_64 engine(index + 1);
  const double part = 0.4 + 0.6 * random_share(engine);
  HandPath hand(way_in.front().pose);
  for (int i = 1; i <= 40; ++i) {
    const h6Pose next = sample_path(way_in, part * way_in.back().t * i / 40);
    hand.go_to(next, std::max(0.01, norm(next.p - hand.pose().p) / pulls.speed));
  }
  const h6Pose here = hand.pose();
  for (int i = 0; i < pulls.count; ++i) {
    const h6Vec3 pull = pulls.reach * in_unit_ball(engine);
    const h6Vec3 turn = pulls.turn * in_unit_ball(engine);
    hand.go_to({here.p + pull, product(turn_by(turn), here.q)}, pulls.reach / pulls.speed);
    hand.wait(0.1);
  }
  hand.wait(0.75);
  return hand.rows();
}

}  // namespace h6::io
