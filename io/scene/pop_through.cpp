// SPDX-License-Identifier: Apache-2.0
#include "io/scene/pop_through.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "hapsix/vector.h"

namespace h6::io {
namespace {

// All in voxels.
constexpr double kFree = 0.3;    // a point farther out is free
constexpr double kBeside = 0.5;  // how far a shadow may step aside
// Heights of a shadow over the surface. A high one sees over rivets and around edges, a low one
// fits into narrow gaps. None is below kFree: a shadow must not be under its point.
constexpr double kHeights[] = {1, 0.5, 1.5, kFree};
// The surface may be nearer than a field says by this, since it rounds off corners.
constexpr double kRounding = 0.75;
constexpr double kRetry = 0.5;  // a parted point looks for its shadow again after this motion
constexpr double kAwake = 0.5;  // no point this near sleeps
constexpr std::size_t kBlock = 64;

// Two directions that are normal to the unit vector n and to each other.
std::pair<h6Vec3, h6Vec3> across(const h6Vec3& n) {
  const h6Vec3 a = std::fabs(n.x) < 0.6 ? h6Vec3{1, 0, 0} : h6Vec3{0, 1, 0};
  const h6Vec3 u = unit(cross(n, a));
  return {u, cross(n, u)};
}

}  // namespace

PopThroughSearch::PopThroughSearch(const h6Model* model, int field, double voxel,
                                   const FieldMesh& mesh, const std::vector<h6Vec3>& points)
    : model_(model), field_(field), voxel_(voxel), mesh_(mesh), points_(points) {
  if (points.empty()) return;
  h6Vec3 low = points[0], high = points[0];
  for (const h6Vec3& p : points) low = min(low, p), high = max(high, p);
  centre_ = 0.5 * (low + high);
  for (const h6Vec3& p : points) radius_ = std::max(radius_, norm(p - centre_));
  tracks_.resize(points.size());
  wake_.resize(points.size());
  block_wake_.resize((points.size() + kBlock - 1) / kBlock);
}

double PopThroughSearch::motion(const h6Pose& from, const h6Pose& to) const {
  return norm(place(to, centre_) - place(from, centre_)) + radius_ * norm(turn(from.q, to.q));
}

// The points whose sleep is over, with their samples.
void PopThroughSearch::sample(const h6Pose& pose) {
  due_.clear();
  for (std::size_t b = 0; b < block_wake_.size(); ++b) {
    if (block_wake_[b] > moved_) continue;
    block_wake_[b] = std::numeric_limits<double>::infinity();
    const std::size_t end = std::min(points_.size(), (b + 1) * kBlock);
    for (std::size_t i = b * kBlock; i < end; ++i) {
      if (wake_[i] > moved_)
        block_wake_[b] = std::min(block_wake_[b], wake_[i]);
      else
        due_.push_back(static_cast<std::uint32_t>(i));
    }
  }
  // place(pose, p), with the turn as a matrix: a map of nut-on-bolt takes 0.85 to 0.98 of its time.
  const h6Vec3 x = rotate(pose.q, {1, 0, 0}), y = rotate(pose.q, {0, 1, 0}),
               z = rotate(pose.q, {0, 0, 1});
  at_.resize(3 * due_.size());
  for (std::size_t k = 0; k < due_.size(); ++k) {
    const h6Vec3& p = points_[due_[k]];
    const h6Vec3 at = pose.p + p.x * x + p.y * y + p.z * z;
    at_[3 * k] = at.x, at_[3 * k + 1] = at.y, at_[3 * k + 2] = at.z;
  }
  distance_.resize(due_.size()), gradient_.resize(at_.size());
  h6SampleField(model_, field_, at_.data(), due_.size(), distance_.data(), gradient_.data(),
                nullptr);
}

void PopThroughSearch::wake(std::uint32_t point, double after) {
  wake_[point] = moved_ + after;
  double& block = block_wake_[point / kBlock];
  block = std::min(block, wake_[point]);
}

// Null where there is no memory for them; look() then fails. A run in which nothing comes near
// needs none, and those of the landing gear took 1.1 s.
const RayScene* PopThroughSearch::rays() const {
  if (rays_ || no_rays_) return rays_;
  const auto& made = mesh_.rays();
  if (made)
    rays_ = made->get();
  else
    no_rays_ = made.failure();
  return rays_;
}

// The first triangle on the straight way.
std::optional<PopThroughSearch::Wall> PopThroughSearch::between(const h6Vec3& from,
                                                                const h6Vec3& to) const {
  const double way = norm(to - from);
  if (!(way > 0) || !rays()) return std::nullopt;
  const h6Vec3 along = (1 / way) * (to - from);
  const RayScene::Hit hit = rays_->first(from, along);
  if (!(hit.t < way)) return std::nullopt;
  return Wall{hit.triangle, from + hit.t * along};
}

// Whether the shadow can go straight, or beside the straight way. `wall` is what stands on the
// straight way.
bool PopThroughSearch::passes(const h6Vec3& from, const h6Vec3& to,
                              std::optional<Wall>& wall) const {
  wall = between(from, to);
  if (!wall) return true;
  const auto [u, v] = across(unit(to - from));
  for (int i = 0; i < 8; ++i) {
    const double a = 0.25 * std::numbers::pi * i;
    const h6Vec3 aside = kBeside * voxel_ * (std::cos(a) * u + std::sin(a) * v);
    if (!between(from, from + aside) && !between(from + aside, to + aside) &&
        !between(to + aside, to))
      return true;
  }
  return false;
}

double PopThroughSearch::distance_at(const h6Vec3& x) const {
  const double at[3] = {x.x, x.y, x.z};
  double distance;
  h6SampleField(model_, field_, at, 1, &distance, nullptr, nullptr);
  return distance;
}

// Whether a triangle is nearer than a free point may be.
bool PopThroughSearch::touches(const h6Vec3& x) const {
  return rays() && rays_->nearest(x, kFree * voxel_).triangle != RayScene::kNoTriangle;
}

// A point in contact: moves its shadow over it, as far as the shadow can go.
void PopThroughSearch::lift(Track& t, const h6Vec3& x, double d, const h6Vec3& out) {
  t.free = false;
  if (!(norm(out) > 0.5)) return;  // so deep that no way leads out
  for (const double height : kHeights) {
    const h6Vec3 shadow = x + (height * voxel_ - d) * out;
    // Inside a sheet the gradient may point along it, and deep inside it may be wrong.
    if (!(distance_at(shadow) > 0)) continue;
    // It starts in contact, maybe inside. Under an edge the rounded field may say that a shadow in
    // the solid is outside, so the shadow must be free. Later a point that is inside comes under
    // edges again, so it waits until it is free itself.
    if (!t.judged) {
      if (steps_ > 0 || height < kFree || touches(shadow) || between(x, shadow)) continue;
      t.judged = true, t.shadow = shadow;
      return;
    }
    std::optional<Wall> wall;
    if (passes(t.shadow, shadow, wall)) {
      t.shadow = shadow, t.parted = false;
      return;
    }
    if (t.parted) continue;
    t.parted = true, t.triangle = wall->triangle, t.place = wall->place, t.crossed = steps_;
  }
}

// A point that is free; false when its shadow cannot come to it.
bool PopThroughSearch::frees(Track& t, const h6Vec3& x) {
  std::optional<Wall> wall;
  // Nothing stands within the distance of the place where both were.
  const double sure = t.distance - kRounding * voxel_;
  const bool open = !t.judged || (t.free && norm(x - t.last) < sure);
  if (!open && !passes(t.shadow, x, wall)) {
    t.free = false;
    // A field rounds off sharp edges: a point under one may look free.
    if (touches(x)) return true;
    if (!t.parted) t.triangle = wall->triangle, t.place = wall->place, t.crossed = steps_;
    t.parted = true;
    return false;
  }
  t.judged = t.free = true, t.parted = false;
  t.shadow = x;
  return true;
}

Result<std::optional<PoppedPoint>> PopThroughSearch::look(const h6Pose& pose) {
  if (steps_ > 0) moved_ += motion(pose_, pose);
  pose_ = pose;
  sample(pose);
  std::optional<PoppedPoint> found;
  for (std::size_t k = 0; k < due_.size(); ++k) {
    const h6Vec3 x = {at_[3 * k], at_[3 * k + 1], at_[3 * k + 2]};
    const double d = distance_[k];
    Track& t = tracks_[due_[k]];
    if (d > kFree * voxel_) {
      if (!frees(t, x) && (!found || t.crossed < found->crossed))
        found = PoppedPoint{due_[k], t.triangle, t.crossed, steps_, t.place};
    } else {
      const h6Vec3 out = {gradient_[3 * k], gradient_[3 * k + 1], gradient_[3 * k + 2]};
      lift(t, x, d, out);
    }
    t.last = x, t.distance = d;
    wake(due_[k], t.parted ? kRetry * voxel_ : std::max(0.0, d - kAwake * voxel_));
  }
  ++steps_;
  if (no_rays_) return *no_rays_;
  return found;
}

}  // namespace h6::io
