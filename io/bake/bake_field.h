// SPDX-License-Identifier: Apache-2.0
// bake_field.h - from a triangle mesh or soup to a sparse signed distance field.
//
// H. Xu, J. Barbic, "Signed distance fields for polygon soup meshes", 2014, for the meaning of the
// sign; inside.cpp says what inside samples are.
#pragma once
#include "hapsix/result.h"
#include "io/field/field_data.h"
#include "io/file/progress.h"
#include "io/mesh/mesh.h"

namespace h6::io {

enum class SignMode { automatic, flood };
// Regions the outside cannot reach: `solid` fills them all. `hollow` counts the walls around a
// region, the fewest on any way from outside, and leaves it empty where that is even. So a ball
// inside a hollow ball is solid again, but two parts that overlap are hollow where they do: for
// separate shells only, and walls at least two voxels thick.
enum class Cavities { solid, hollow };

struct FieldBake {
  int voxels = 256;       // cells on the longest padded side, 16 .. 2048; not used when
  double voxel_size = 0;  // this is > 0 [m]
  double offset = -1;     // sigma [m]; < 0: chosen (0 when closed, else 0.9 voxel)
  SignMode sign = SignMode::automatic;
  Cavities cavities = Cavities::solid;
  // > 0: holes of an open mesh up to this width [m] are closed, so that a part with missing
  // triangles does not drain. Gaps narrower than this that lead to anything deeper are closed too;
  // concave corners stay open. Closed meshes have no holes: nothing changes.
  double seal = 0;
  double band_voxels = 3;  // every cell nearer than this to the surface gets samples
  int padding_voxels = 8;  // empty cells around the mesh
  unsigned threads = 0;    // 0: all
};

// What a bake found that a user should hear: "12 holes ...", one sentence each.
struct FieldBakeReport {
  bool closed = false;
  double sealed_area = 0;  // [m^2] put across holes
  std::vector<std::string> warnings;
  // Where the time went, in the order of work. Stages that run side by side with others count only
  // while nothing else is waited for.
  struct Stage {
    std::string name;
    double seconds;
  };
  std::vector<Stage> stages;
};

// What the samples are. Outside: distance to the surface less offset, exact up to band + 2 voxels
// and a lower bound of that beyond. Inside a closed mesh: minus the distance to the surface,
// likewise. Inside a soup: minus (distance + offset), the way out through the nearest sheet, or
// distance - offset between that sheet and the zero set. Where sheets lie buried in the solid
// (parts that run into each other) the way out is up to 0.74 voxel + 13 % too short; in a few
// places too long (inside.cpp).
// far_grid: a lower bound of the distance, outside by a voxel at most.
Result<FieldData> bake_field(const Mesh& mesh, const FieldBake& options, FieldBakeReport* report,
                             const Progress& progress = {});

}  // namespace h6::io
