// SPDX-License-Identifier: Apache-2.0
// candidates.h - candidates for points, spread over a surface. Private to this folder.
#pragma once
#include <cstdint>

#include "hapsix/result.h"
#include "io/field/view.h"
#include "io/file/raw_vector.h"
#include "io/mesh/inward_normals.h"
#include "io/mesh/ray_scene.h"
#include "io/shell/bake_shell.h"
#include "io/shell/blue_noise.h"

namespace h6::io {

// The wanted shell, in the unit of its candidates.
struct Demand {
  std::size_t points = 0;
  double spacing = 0;  // replaces `points` when > 0
  std::uint64_t seed = 1;
  unsigned threads = 0;

  bool by_spacing() const { return spacing > 0; }
  // The number of points for this area. Fails, with a sentence, if it is too large.
  Result<double> wanted(double area) const;
  // Roughly the distance between the points.
  double guess(double area, double count) const;
};

struct Candidates {
  RawVector<OrientedPoint> points;
  RawVector<std::uint32_t> source;  // triangle
  double area = 0;                  // about the surface's area
  double hidden = 0;                // share of the triangles' area that the outside does not reach
};

// The number of candidates for so many points: few leave gaps, many take time.
double candidates_for(double points, bool by_spacing);

// triangles.cpp: candidates on the triangles, in metres, as `reach` says. Open pieces get
// candidates on both sides.
struct Reach {
  const FieldView* field = nullptr;  // null: candidates everywhere, on the outer side
  double offset = 0;                 // sigma [voxel]
  bool field_normals = false;
  bool hide = true;  // only where the outside reaches; false: the field only gives normals
};
Result<Candidates> sample_triangles(const Mesh& mesh, const FaceTable& faces, const Reach& reach,
                                    const Demand& demand, Pulse& pulse);
// Whether the outside reaches a place of the surface, looking along the unit vector `out`.
bool reached(const Reach& reach, const Vec3& place, const Vec3& out);

// tolerance.cpp: the points of a shell with a tolerance [m], not only candidates: at most
// demand.spacing apart, and closer where the surface turns.
Result<Candidates> points_to_tolerance(const Mesh& mesh, const FaceTable& faces, const Reach& reach,
                                       const Demand& demand, double tolerance, Pulse& pulse);

// zero_set.cpp: candidates near the zero set of a field, where the outside reaches it. They and
// `demand` are in voxels of the field's grid. They have no sources yet.
Result<Candidates> sample_zero_set(const FieldData& field, const Demand& demand, Pulse& pulse);
// Moves candidates to where the distance to the mesh is exactly the field's offset, and sets
// sources.
struct ZeroSet {
  const Mesh* mesh = nullptr;
  const FieldData* field = nullptr;
  const RayScene* nearest = nullptr;
  bool triangle_normals = false;
};
void settle(const ZeroSet& of, unsigned threads, Pulse& pulse, Candidates& candidates);

}  // namespace h6::io
