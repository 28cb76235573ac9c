// SPDX-License-Identifier: Apache-2.0
// ray_votes.cpp - see ray_votes.h.
#include "io/check/ray_votes.h"

#include <algorithm>
#include <cmath>

namespace h6::io {

bool RayVotes::says_inside(const Vec3& place, const Vec3& along,
                           std::vector<Crossing>& room) const {
  rays_.crossings(place, along, room);
  int left = 0;
  for (const Crossing& c : room) {
    if (faces_.sheet[c.triangle]) continue;
    const Vec3& n = faces_.inward[c.triangle];
    left += n.x * along.x + n.y * along.y + n.z * along.z < 0 ? 1 : -1;
  }
  return room.size() % 2 == 1 || left > 0;
}

RayVotes::Side RayVotes::side(const Vec3& place, Dice& dice) const {
  std::vector<Crossing> room;
  const int enough = faces_.sheets > 0 ? 24 : 5, most = faces_.sheets > 0 ? 24 : 11;
  int votes[2] = {0, 0};
  for (int ray = 1; ray <= most; ++ray) {
    ++votes[says_inside(place, dice.direction(), room)];
    const int against = std::min(votes[0], votes[1]);
    if (against > 1) return Side::doubtful;
    if (ray == enough && against == 0) break;
  }
  return votes[1] > votes[0] ? Side::inside : Side::outside;
}

// How far a ball moves before it touches the mesh; infinity if it never does.
double RayVotes::run(const Vec3& from, const Vec3& along, double clearance) const {
  const double free = rays_.free_way(from, along);
  if (clearance <= 0) return free;
  // Sphere tracing: each step is as long as the free distance. Beyond the last triangle on the ray,
  // others may still be beside it.
  double t = 0, step = 0;
  for (int i = 0; i < 1000; ++i) {
    if (t > rays_.reach()) return std::isinf(free) ? free : t;
    const Vec3 at{from.x + t * along.x, from.y + t * along.y, from.z + t * along.z};
    step = rays_.distance(at) - clearance;
    if (step < 0.01 * clearance) break;
    t += step;
  }
  return t;
}

bool RayVotes::way_out(const Vec3& place, double clearance, int runs, Dice& dice) const {
  Vec3 at = place;
  if (clearance > 0 && rays_.distance(at) < clearance) return false;
  for (int i = 0; i < runs; ++i) {
    const Vec3 along = dice.direction();
    const double t = run(at, along, clearance);
    if (std::isinf(t)) return true;
    const double part = t * dice.within(0.1, 0.95);
    at = {at.x + part * along.x, at.y + part * along.y, at.z + part * along.z};
  }
  return false;
}

}  // namespace h6::io
