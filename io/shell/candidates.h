// SPDX-License-Identifier: Apache-2.0
// candidates.h - private to the bake of shells: candidates for points, spread over a surface.
#pragma once
#include <cstdint>

#include "hapsix/result.h"
#include "io/field/view.h"
#include "io/file/raw_vector.h"
#include "io/mesh/inward_normals.h"
#include "io/mesh/nearest_triangle.h"
#include "io/shell/bake_shell.h"
#include "io/shell/blue_noise.h"

namespace h6::io {

// What a shell is to be, in the unit of its samples.
struct Demand {
  std::size_t points = 0;  // not used when
  double spacing = 0;      // this is > 0
  std::uint64_t seed = 1;
  unsigned threads = 0;

  bool by_spacing() const { return spacing > 0; }
  // How many points an area takes; a sentence when that is too many.
  Result<double> wanted(double area) const;
  // The distance between them, roughly.
  double guess(double area, double count) const;
};

struct Candidates {
  RawVector<OrientedPoint> points;
  RawVector<std::uint32_t> source;  // triangle
  double area = 0;                  // of the surface, about
  double hidden = 0;                // share of the triangles' area that is not reached
};

// Many for each point: few leave gaps, many take time.
double candidates_for(double points, bool by_spacing);

// triangles.cpp. On the triangles, in metres. Without `reach` everywhere, on the outer side;
// with it where the outside comes near: pieces that do not close on both sides.
struct Reach {
  const FieldView* field = nullptr;
  double offset = 0;  // sigma [voxel]
  bool field_normals = false;
  bool hide = true;  // false: the field is there for the normals only
};
Result<Candidates> sample_triangles(const Mesh& mesh, const FaceTable& faces, const Reach& reach,
                                    const Demand& demand, Pulse& pulse);

// zero_set.cpp. Near the zero set of a field, where the outside reaches it, in voxels of the
// field's grid (demand too); no sources yet.
Result<Candidates> sample_zero_set(const FieldData& field, const Demand& demand, Pulse& pulse);
// To where the distance to the mesh is exactly the field's offset, with sources.
struct ZeroSet {
  const Mesh* mesh = nullptr;
  const FieldData* field = nullptr;
  const NearestTriangle* nearest = nullptr;
  bool triangle_normals = false;
};
void settle(const ZeroSet& of, unsigned threads, Pulse& pulse, Candidates& candidates);

}  // namespace h6::io
