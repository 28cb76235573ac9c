// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/exact.h"

#include <algorithm>

#include "hapsix/vector.h"

namespace h6::peers {

Summary sum_up(const std::vector<Contact>& contacts) {
  Summary out;
  h6Vec3 sum{};
  for (const Contact& c : contacts) {
    if (!(c.depth > 0)) continue;
    ++out.contacts;
    out.deepest = std::max(out.deepest, c.depth);
    sum = sum + c.depth * c.push;
  }
  if (norm(sum) > 0) out.push = unit(sum);
  return out;
}

Exact::Exact(const Task& task)
    : task_(task), rays_(std::move(*io::RayScene::make(task.obstacle))) {}

Exact::Truth Exact::at(const h6Pose& pose, const std::vector<std::uint32_t>& inside,
                       const std::vector<Contact>& sampled) const {
  const double offset = task_.field.offset;
  std::vector<Contact> on_field, on_triangles;
  for (std::size_t i = 0; i < inside.size(); ++i) {
    const h6Vec3 p = place(pose, task_.points[inside[i]]);
    const io::RayScene::Near near = rays_->nearest(p);
    if (!(near.distance > 0)) continue;
    const h6Vec3 towards = (1 / near.distance) * (near.point - p);
    // Between the surfaces of field and triangles a point is outside the triangles.
    if (sampled[i].depth > offset) {
      on_field.push_back({p, towards, near.distance + offset});
      on_triangles.push_back({p, towards, near.distance});
    } else {
      on_field.push_back({p, -towards, offset - near.distance});
    }
  }
  return {sum_up(on_field), sum_up(on_triangles)};
}

}  // namespace h6::peers
