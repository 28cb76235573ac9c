// SPDX-License-Identifier: Apache-2.0
// clearance.cpp - see clearance.h.
#include "io/check/clearance.h"

#include <algorithm>
#include <vector>

#include "io/check/surface_places.h"
#include "io/mesh/ray_scene.h"
#include "sched/parallel_for.h"

namespace h6::io {

Result<double> clearance(const Mesh& part, const h6Pose& part_pose, const Mesh& other,
                         const h6Pose& other_pose, unsigned threads, std::size_t places) {
  const Mesh here = moved(part, part_pose), there = moved(other, other_pose);
  const Result<std::unique_ptr<RayScene>> rays = RayScene::make(there);
  if (!rays) return rays.failure();
  const SurfacePlaces surface(here);
  if (!(surface.area() > 0)) return std::numeric_limits<double>::infinity();
  const std::size_t corners = 3 * here.triangles.size(), all = corners + places;
  constexpr std::size_t kBlock = 1024;
  std::vector<double> least((all + kBlock - 1) / kBlock, std::numeric_limits<double>::infinity());
  sched::parallel_for(least.size(), threads, [&](std::size_t b) {
    for (std::size_t i = kBlock * b; i < std::min(all, kBlock * (b + 1)); ++i) {
      Dice dice(1, i);
      const Vec3 p = i < corners ? here.vertices[here.triangles[i / 3][i % 3]] : surface(dice).p;
      least[b] = std::min(least[b], (*rays)->distance(p));
    }
  });
  return *std::min_element(least.begin(), least.end());
}

}  // namespace h6::io
