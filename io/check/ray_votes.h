// SPDX-License-Identifier: Apache-2.0
// ray_votes.h - on which side of a mesh a place is, as rays see it, and whether it can be left.
#pragma once
#include <vector>

#include "io/check/ray_scene.h"
#include "io/mesh/inward_normals.h"

namespace h6::io {

class RayVotes {
 public:
  // Of the mesh that `rays` and `faces` are of; both must outlive this.
  RayVotes(const RayScene& rays, const FaceTable& faces) : rays_(rays), faces_(faces) {}

  // A ray says inside when it crosses the mesh an odd number of times, or leaves more of its closed
  // pieces than it enters: parts that overlap are one solid. Five that agree decide, or ten in
  // eleven; where the mesh has pieces that do not close, half of all rays cross any of them that is
  // near, and 23 of 24 must agree. Else it is in doubt.
  enum class Side { outside, inside, doubtful };
  Side side(const Vec3& place, Dice& dice) const;

  // Whether a ball of radius `clearance` [m] (0: a point) finds a way to far outside that touches
  // no triangle: straight runs in random directions, each begun somewhere along the one before.
  // True is proof; false is not, a narrow way is easily missed.
  bool way_out(const Vec3& place, double clearance, int runs, Dice& dice) const;

 private:
  bool says_inside(const Vec3& place, const Vec3& along, std::vector<Crossing>& room) const;
  double run(const Vec3& from, const Vec3& along, double clearance) const;
  const RayScene& rays_;
  const FaceTable& faces_;
};

}  // namespace h6::io
