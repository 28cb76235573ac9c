// SPDX-License-Identifier: Apache-2.0
// pop_through.h - finds the first shell point that passed through the environment's mesh.
//
//        . A
//   =====|=====
//        . B
//
// This is the god-object's rule (Zilles & Salisbury 1995), judged after the run. Each point has a
// shadow that stays on the free side. Where the point is free, the shadow is the point. While the
// point is in contact, the shadow is the point lifted out of the field along its gradient. The
// shadow moves only along straight ways that meet no triangle. A point that is free where its
// shadow cannot come has popped through: from A to B there is no way near the one that it took.
//
// A point keeps its shadow when it slides along a wall, at any depth, or dips in and comes out of
// the same side. The shadow may step aside by half a voxel, so a point may cut the border of a
// sheet by that much. For the same reason wires thinner than about a voxel cannot be seen. A point
// that starts inside, or too near to an edge to tell, is not judged before it has once been free.
// Free means farther than 0.3 voxel outside the field, and from all triangles.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "hapsix/hapsix.h"
#include "io/scene/field_mesh.h"

namespace h6::io {

struct PoppedPoint {
  std::uint32_t point;     // of the shell
  std::uint32_t triangle;  // of the mesh: the first one between the point and its shadow
  std::size_t crossed;     // the step at which its way out first lay behind that triangle
  std::size_t freed;       // the step at which it was free there
  h6Vec3 place;            // of the crossing, field's mesh frame [m]
};

// Follows one shell in the frame of one field's body. All poses are shell -> field, in order.
class PopThroughSearch {
 public:
  // `model` and `mesh` are those of the field, `voxel` is its size [m]. All must outlive this.
  PopThroughSearch(const h6Model* model, int field, double voxel, const FieldMesh& mesh,
                   const std::vector<h6Vec3>& points);

  // How far a point of the shell can have moved between two poses, at most [m].
  double motion(const h6Pose& from, const h6Pose& to) const;
  // Poses closer than this to the last one need not be given [m]: a fifth of a voxel.
  double step() const { return 0.2 * voxel_; }

  // Looks at the next pose. The first point that is through ends the search: of several at this
  // pose the one that crossed first. Fails when there is no memory for rays.
  Result<std::optional<PoppedPoint>> look(const h6Pose& pose);

 private:
  struct Track {
    h6Vec3 last{}, shadow{};  // field's mesh frame [m]
    double distance = 0;      // of `last` [m]
    bool judged = false;      // it has a shadow
    bool free = false;        // `last` was free, and the shadow with it
    bool parted = false;      // a triangle stands between it and its shadow
    std::uint32_t triangle = 0;
    std::size_t crossed = 0;
    h6Vec3 place{};
  };
  struct Wall {
    std::uint32_t triangle;
    h6Vec3 place;
  };

  void sample(const h6Pose& pose);
  double distance_at(const h6Vec3& x) const;
  bool touches(const h6Vec3& x) const;
  const RayScene* rays() const;
  std::optional<Wall> between(const h6Vec3& from, const h6Vec3& to) const;
  bool passes(const h6Vec3& from, const h6Vec3& to, std::optional<Wall>& wall) const;
  void lift(Track& t, const h6Vec3& x, double d, const h6Vec3& out);
  bool frees(Track& t, const h6Vec3& x);
  void wake(std::uint32_t point, double after);

  const h6Model* model_;
  int field_;
  double voxel_;
  const FieldMesh& mesh_;
  mutable const RayScene* rays_ = nullptr;  // made once something is near
  mutable std::optional<Failure> no_rays_;
  const std::vector<h6Vec3>& points_;
  h6Vec3 centre_{};
  double radius_ = 0;
  std::vector<Track> tracks_;
  // A point sleeps until the shell has moved as far as its distance. The sleep of a block is that
  // of the point that wakes first.
  std::vector<double> wake_, block_wake_;
  double moved_ = 0;
  h6Pose pose_{};
  std::size_t steps_ = 0;
  std::vector<std::uint32_t> due_;
  std::vector<double> at_, distance_, gradient_;
};

}  // namespace h6::io
