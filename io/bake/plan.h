// SPDX-License-Identifier: Apache-2.0
// plan.h - size, memory and time of a field bake, estimated before it runs.
#pragma once
#include <array>
#include <cstdint>
#include <string>

#include "hapsix/result.h"
#include "io/bake/bake_field.h"
#include "io/mesh/mesh.h"

namespace h6::io {

struct FieldPlan {
  double voxel_size = 0, offset = 0;     // as the bake will choose them [m]; the coarse voxel
  double finest = 0;                     // the finest voxel [m]
  std::array<std::int32_t, 3> bricks{};  // along x, y, z
  std::size_t brick_count = 0;           // bricks with samples, mostly within a tenth
  std::size_t bytes = 0;                 // of the field in memory; roughly, with a tolerance
  std::size_t engine_bytes = 0;          // of the field in the engine's layout, without finer cells
  // The memory of the process at the bake's peak, or while it writes the field. bench/README.md,
  // "Memory", says how true it is. The bake itself asks what is free.
  std::size_t peak_bytes = 0;
  double seconds = 0;  // a rough guess, for two threads of a server of 2023
};

// Fails where the bake would fail, with the same sentence.
Result<FieldPlan> plan_field(const Mesh& mesh, const MeshAudit& audit, const FieldBake& options);

// "about 1.2 GB of memory and 3 s". Fails, with a sentence, if a bake of this plan is far from
// fitting into the memory that is free [bytes].
Result<std::string> needs_of(const FieldPlan& plan, std::uint64_t free);

// The sentence for a bake that takes more than what is free [bytes].
Failure takes_more_than(double free);

// Fails, with a sentence, if a bake cannot take so many more bytes.
Outcome room_for(double bytes, const FieldBake& options);

}  // namespace h6::io
