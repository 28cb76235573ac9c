// SPDX-License-Identifier: Apache-2.0
#include "io/propose/free_way.h"

#include <algorithm>

#include "io/check/ray_votes.h"
#include "sched/parallel_for.h"

namespace h6::io {
namespace {

constexpr std::size_t kPlaces = 8000;  // vertices, and as many places uniform by area
constexpr std::size_t kVoters = 300;   // places that are asked for their side
constexpr std::size_t kSlice = 512;

// Vertices of triangles, evenly taken where there are more than kPlaces, then random places.
std::vector<Vec3> places_on(const Mesh& mesh) {
  std::vector<Vec3> out;
  const std::size_t corners = 3 * mesh.triangles.size();
  const std::size_t step = std::max<std::size_t>(1, corners / kPlaces);
  for (std::size_t i = 0; i < corners; i += step)
    out.push_back(mesh.vertices[mesh.triangles[i / 3][i % 3]]);
  const SurfacePlaces surface(mesh);
  for (std::size_t i = 0; surface.area() > 0 && i < kPlaces; ++i) {
    Dice dice(1, i);
    out.push_back(surface(dice).p);
  }
  return out;
}

template <class Work>
void in_slices(std::size_t count, unsigned threads, Work work) {
  sched::parallel_for((count + kSlice - 1) / kSlice, threads, [&](std::size_t s) {
    work(s, s * kSlice, std::min(count, (s + 1) * kSlice));
  });
}

std::size_t slices_of(std::size_t count) { return (count + kSlice - 1) / kSlice; }

}  // namespace

Outcome FreeWay::fill(Side& side, Mesh mesh) {
  side.mesh = std::move(mesh);
  Result<std::unique_ptr<RayScene>> rays = RayScene::make(side.mesh);
  if (!rays) return rays.failure();
  side.rays = std::move(*rays);
  side.faces = face_table(side.mesh);
  side.places = places_on(side.mesh);
  if (!(SurfacePlaces(side.mesh).area() > 0)) return Failure{"the mesh has no area"};
  return Done{};
}

Result<std::unique_ptr<FreeWay>> FreeWay::make(Mesh part, Mesh others, unsigned threads) {
  std::unique_ptr<FreeWay> out(new FreeWay);
  out->threads_ = threads;
  if (Outcome done = fill(out->part_, std::move(part)); !done) return done.failure();
  if (Outcome done = fill(out->others_, std::move(others)); !done) return done.failure();
  return out;
}

FreeWay::Nearest FreeWay::nearest(const Vec3& shift) const {
  constexpr Nearest kFar{std::numeric_limits<double>::infinity(), {}, {}};
  const std::size_t of_part = part_.places.size(), all = of_part + others_.places.size();
  std::vector<Nearest> best(slices_of(all), kFar);
  in_slices(all, threads_, [&](std::size_t s, std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
      const bool mine = i < of_part;
      const Vec3 place = mine ? part_.places[i] + shift : others_.places[i - of_part];
      const RayScene::Near found = mine ? others_.rays->nearest(place, best[s].distance)
                                        : part_.rays->nearest(place - shift, best[s].distance);
      if (found.triangle == RayScene::kNoTriangle || found.distance >= best[s].distance) continue;
      best[s] = mine ? Nearest{found.distance, place, found.point}
                     : Nearest{found.distance, found.point + shift, place};
    }
  });
  return *std::min_element(best.begin(), best.end(), [](const Nearest& a, const Nearest& b) {
    return a.distance < b.distance;
  });
}

double FreeWay::share_inside(const Side& whose, const Side& in, const Vec3& shift,
                             double deeper) const {
  const RayVotes votes(*in.rays, in.faces);
  const std::size_t step = std::max<std::size_t>(1, whose.places.size() / kVoters);
  const std::size_t count = whose.places.size() / step;
  // A place this near is on the surface.
  const double touching = std::max(deeper, 1e-5 * in.rays->reach());
  std::vector<std::size_t> found(slices_of(count));
  in_slices(count, threads_, [&](std::size_t s, std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
      Dice dice(2, i);
      const Vec3 place = whose.places[i * step] + shift;
      if (votes.side(place, dice) == RayVotes::Side::inside && in.rays->distance(place) > touching)
        ++found[s];
    }
  });
  std::size_t sum = 0;
  for (const std::size_t n : found) sum += n;
  return count ? static_cast<double>(sum) / static_cast<double>(count) : 0;
}

double FreeWay::inside(const Vec3& shift, double deeper) const {
  return std::max(share_inside(part_, others_, shift, deeper),
                  share_inside(others_, part_, -1 * shift, deeper));
}

double FreeWay::farthest_hit(const Side& from, const Side& to, const Vec3& along) const {
  std::vector<double> far(slices_of(from.places.size()));
  in_slices(from.places.size(), threads_, [&](std::size_t s, std::size_t first, std::size_t end) {
    std::vector<Crossing> hits;
    for (std::size_t i = first; i < end; ++i) {
      to.rays->crossings(from.places[i], along, hits);
      for (const Crossing& hit : hits) far[s] = std::max(far[s], hit.t);
    }
  });
  return far.empty() ? 0 : *std::max_element(far.begin(), far.end());
}

double FreeWay::way_out(const Vec3& along) const {
  return std::max(farthest_hit(part_, others_, along), farthest_hit(others_, part_, -1 * along));
}

}  // namespace h6::io
