// SPDX-License-Identifier: Apache-2.0
// plan.h - what a field bake will give and ask for, before it is made.
#pragma once
#include <array>
#include <cstdint>

#include "hapsix/result.h"
#include "io/bake/bake_field.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct FieldPlan {
  double voxel_size = 0, offset = 0;     // as the bake will choose them [m]
  std::array<std::int32_t, 3> bricks{};  // along x, y, z
  std::size_t brick_count = 0;           // with samples, to a tenth as a rule
  std::size_t bytes = 0;                 // of the field in memory; in the engine's layout, below
  std::size_t engine_bytes = 0;
  double seconds = 0;  // of a bake by two threads of a server of 2023; a rough guess
};

// The failure is the one that the bake would end with.
Result<FieldPlan> plan_field(const Mesh& mesh, const MeshAudit& audit, const FieldBake& options);

}  // namespace h6::io
