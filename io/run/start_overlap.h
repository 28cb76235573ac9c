// SPDX-License-Identifier: Apache-2.0
// start_overlap.h - names the parts that overlap at the start of a run (METHOD.md, Sec. 7).
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "hapsix/hapsix.h"
#include "hapsix/result.h"
#include "io/scene/load_scene.h"

namespace h6::cli {

// Two parts of a scene that overlap: the shell of `part` is inside the field of `with`.
struct PartOverlap {
  std::string part, with;
  std::string with_part;  // of the field's mesh, near the deepest point; may be empty
  std::uint32_t points = 0;
  std::uint32_t relieved = 0;  // of these, points that push only beyond their depth at the start
  std::uint32_t unknown = 0;   // of these, points so deep that the field knows only bounds
  double depth = 0;            // of the deepest point [m]
  double depth_voxels = 0;     // the same in voxels of the field
  h6Vec3 place{};              // of the deepest point, world frame [m]
  std::string sentence;        // what a person should know of it
};

// The parts that overlap in `session`, which was made with `contact` and has not stepped yet.
std::vector<PartOverlap> start_overlaps(const io::LoadedScene& loaded, const h6ContactDef& contact,
                                        const h6Session* session);

// Fails where points take no part because they start too deep: a run could then move the part
// through what it was in. The sentence names the deepest of these pairs and what to do.
Outcome check_start(const std::vector<PartOverlap>& overlaps, io::Unit unit);

// Every point that is inside, one a row, with lengths in the scene's units.
std::string overlap_csv(const io::LoadedScene& loaded, const h6Session* session);

}  // namespace h6::cli
