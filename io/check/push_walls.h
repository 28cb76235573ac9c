// SPDX-License-Identifier: Apache-2.0
// push_walls.h - the force that the walls of a field hold, found by runs of the engine.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"
#include "io/check/wall_thickness.h"
#include "io/field/field_data.h"
#include "io/file/progress.h"
#include "io/mesh/inward_normals.h"
#include "io/mesh/mesh.h"
#include "io/mesh/ray_scene.h"

namespace h6::io {

struct WallPushes {
  std::size_t places = 0;          // pushed at, from at least one side
  std::vector<WallPlace> through;  // of them, in the order of places
};

// Pushes a part of one point at places of a field, slowly, from both sides, by a virtual coupling
// that saturates at a force, with the default method. A push that would start inside the field is
// left out.
//
// A point is through when its way crosses a sheet or leaves the mesh's solids by a face opposite
// the one where it came in, or when it sinks on and on into a thick wall. A cavity counts as
// outside, even where the field fills it and would hold the point farther in, because there the
// user sees the tool behind a wall. A point that slides round to a face 45 degrees off has not been
// pushed through, but a guided tool could have been: a second hand holds it on its line, again.
class WallPusher {
 public:
  // Needs a field of this mesh; both must outlive this. stiffness: of the contact [N/m]. Fails if
  // the engine refuses the field, or without memory.
  static Result<std::unique_ptr<WallPusher>> make(const Mesh& mesh, const FieldData& field,
                                                  double stiffness);
  // force > 0 [N]. The result is the same for any number of threads (0: all).
  WallPushes push(std::span<const WallPlace> places, double force, unsigned threads) const;

 private:
  enum class Ended { held, slid, through, left_out };
  struct Push;
  struct Free {
    void operator()(h6Model* model) const { h6DestroyModel(model); }
    void operator()(h6Session* session) const { h6DestroySession(session); }
  };
  using Session = std::unique_ptr<h6Session, Free>;
  WallPusher(const Mesh& mesh, const FieldData& field, double stiffness);
  Session session_of(const Push& push, const h6Pose& start) const;
  Ended end_of(const Push& push) const;

  const Mesh mesh_;  // without inner faces
  const FaceTable faces_;
  const FieldData& field_;
  double stiffness_;
  std::unique_ptr<RayScene> rays_;
  std::unique_ptr<h6Model, Free> model_;
};

struct HeldForce {
  double force = 0;  // [N] held at all places; 0: some place holds nothing
  std::size_t places = 0;
  std::size_t through = 0;  // places that let the least force through, if force is 0
  WallPlace weakest{};      // lets a little more than `force` through
};

// Searches, to a tenth, for the largest force that is held at all places, then takes three
// tenths off and pushes at all again, so that places between those hold too. Fails as WallPusher
// does, or when the user cancels.
Result<HeldForce> find_held_force(const Mesh& mesh, const FieldData& field,
                                  std::span<const WallPlace> places, double stiffness,
                                  unsigned threads, const Progress& progress = {});

}  // namespace h6::io
