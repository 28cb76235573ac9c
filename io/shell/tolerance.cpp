// SPDX-License-Identifier: Apache-2.0
// tolerance.cpp - points so close that no flat obstacle enters between them by more than a
// tolerance.
//
// A candidate q with outward normal n is left out only where a chosen point s is nearer than the
// spacing, on the same side of a thin part, and q stands out beyond s by n (q - s) <= tolerance. So
// points are sqrt(2 tolerance / curvature) apart where that is less than the spacing. Corners come
// first, then edges, then the rest: each stage need not repeat what the one before it covers.
#include "io/shell/creases.h"

namespace h6::io {
namespace {

class Stages {
 public:
  Stages(const Demand& demand, double tolerance, Pulse& pulse) : pulse_(pulse) {
    thinning_.target = max_shell_points;
    thinning_.first_radius = demand.spacing;
    thinning_.fixed_radius = true;
    thinning_.tolerance = tolerance;
    thinning_.seed = demand.seed;
    thinning_.threads = demand.threads;
    thinning_.pulse = &pulse;
  }

  // Adds what is needed of the candidates. `places`: null, or their ridges.
  bool add(const Candidates& more, const Creases::Places* places, const Creases& creases) {
    const std::size_t kept = all_.points.size();
    all_.points.insert(all_.points.end(), more.points.begin(), more.points.end());
    all_.source.insert(all_.source.end(), more.source.begin(), more.source.end());
    thinning_.kept = kept;
    const Thinned thinned = thin_out(all_.points, thinning_);
    if (thinned.cancelled || !pulse_.alive()) return false;
    for (std::size_t i = kept; i < thinned.chosen.size(); ++i) {
      all_.points[i] = all_.points[thinned.chosen[i]];
      all_.source[i] = all_.source[thinned.chosen[i]];
    }
    all_.points.resize(thinned.chosen.size());
    all_.source.resize(thinned.chosen.size());
    if (places == nullptr) return true;
    for (std::size_t i = kept; i < thinned.chosen.size(); ++i) {
      const std::uint32_t ridge = places->ridge[thinned.chosen[i] - kept];
      for (std::uint32_t n = creases.first[ridge]; n < creases.first[ridge + 1]; ++n) {
        const Vec3& normal = creases.normals[n];
        OrientedPoint twin = all_.points[i];
        twin.n[0] = float(normal.x), twin.n[1] = float(normal.y), twin.n[2] = float(normal.z);
        all_.points.push_back(twin);
        all_.source.push_back(std::uint32_t{all_.source[i]});
      }
    }
    return true;
  }
  Candidates take() { return std::move(all_); }

 private:
  Pulse& pulse_;
  Thinning thinning_;
  Candidates all_;
};

void append(const Candidates& more, Candidates& to) {
  to.points.insert(to.points.end(), more.points.begin(), more.points.end());
  to.source.insert(to.source.end(), more.source.begin(), more.source.end());
}

}  // namespace

Result<Candidates> points_to_tolerance(const Mesh& mesh, const FaceTable& faces, const Reach& reach,
                                       const Demand& demand, double tolerance, Pulse& pulse) {
  const Failure cancelled{"cancelled"};
  Result<Candidates> area = sample_triangles(mesh, faces, reach, demand, pulse);
  if (!area) return area;
  const Creases creases = find_creases(mesh, faces, reach, demand.spacing, tolerance, pulse);
  if (!pulse.alive()) return cancelled;
  append(creases.faces, *area);
  Stages stages(demand, tolerance, pulse);
  if (!stages.add(creases.corners.of, &creases.corners, creases) ||
      !stages.add(creases.edges.of, &creases.edges, creases) ||
      !stages.add(*area, nullptr, creases))
    return cancelled;
  Candidates out = stages.take();
  out.area = area->area, out.hidden = area->hidden;
  return out;
}

}  // namespace h6::io
