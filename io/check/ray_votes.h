// SPDX-License-Identifier: Apache-2.0
// ray_votes.h - the side of a mesh that a place is on, by votes of rays, and ways out of it.
#pragma once
#include <vector>

#include "io/check/surface_places.h"
#include "io/mesh/inward_normals.h"
#include "io/mesh/ray_scene.h"

namespace h6::io {

class RayVotes {
 public:
  // `rays` and `faces` must be of the same mesh and must outlive this.
  RayVotes(const RayScene& rays, const FaceTable& faces) : rays_(rays), faces_(faces) {}

  // A ray votes inside if it crosses the mesh an odd number of times, or leaves more closed pieces
  // than it enters, so that overlapping parts are one solid. Five rays that agree decide, or ten in
  // eleven. If the mesh has open pieces, 23 of 24 must agree, since half of all rays cross an open
  // piece that is near. Otherwise the side is doubtful.
  enum class Side { outside, inside, doubtful };
  Side side(const Vec3& place, Dice& dice) const;

  // Whether a ball of radius `clearance` [m] (0: a point) finds a way far outside that touches no
  // triangle. It makes up to `runs` straight runs in random directions, each from a random place
  // along the one before. True is a proof. False proves nothing, because the search easily misses a
  // narrow way.
  bool way_out(const Vec3& place, double clearance, int runs, Dice& dice) const;

 private:
  bool says_inside(const Vec3& place, const Vec3& along, std::vector<Crossing>& room) const;
  double run(const Vec3& from, const Vec3& along, double clearance) const;
  const RayScene& rays_;
  const FaceTable& faces_;
};

}  // namespace h6::io
