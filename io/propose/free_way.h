// SPDX-License-Identifier: Apache-2.0
// free_way.h - how a part stands to what is around it: distance, containment, and ways out.
//
// Exact distances and rays of Embree from places on both surfaces: vertices, and places uniform by
// area. So a distance is an upper bound that is close for meshes finer than their gaps, and a way
// out can be too short by what lies between the places. The engine's own start check has the last
// word (io/run/start_overlap.h).
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "hapsix/result.h"
#include "io/check/surface_places.h"
#include "io/mesh/inward_normals.h"
#include "io/mesh/mesh.h"
#include "io/mesh/ray_scene.h"

namespace h6::io {

class FreeWay {
 public:
  // Fails without memory, or if a mesh has no area. `threads`: 0 takes all.
  static Result<std::unique_ptr<FreeWay>> make(Mesh part, Mesh others, unsigned threads);

  struct Nearest {
    double distance;  // [m]
    Vec3 from, to;    // on the moved part, on the others
  };
  // With the part moved by `shift` [m].
  Nearest nearest(const Vec3& shift) const;
  // The share of places of one side that lie inside a closed piece of the other, farther than
  // `deeper` [m] from its surface, the larger of both sides; 0 .. 1.
  double inside(const Vec3& shift, double deeper = 0) const;
  // How far [m] the part has to go along the unit vector until nothing of it meets the others any
  // more, however far it goes on; 0 if it meets nothing at all.
  double way_out(const Vec3& along) const;

 private:
  struct Side {
    Mesh mesh;
    std::unique_ptr<RayScene> rays;
    FaceTable faces;
    std::vector<Vec3> places;
  };
  static Outcome fill(Side& side, Mesh mesh);
  double share_inside(const Side& whose, const Side& in, const Vec3& shift, double deeper) const;
  double farthest_hit(const Side& from, const Side& to, const Vec3& along) const;
  Side part_, others_;
  unsigned threads_ = 0;
};

}  // namespace h6::io
