// SPDX-License-Identifier: Apache-2.0
// ray_scene.cpp - Embree proposes triangles, double decides (see ray_scene.h).
#include "io/mesh/ray_scene.h"

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/bake/triangle_distance.h"

namespace h6::io {
namespace {

// Embree 3 takes a ray's filter in its context, Embree 4 in arguments of their own.
#if RTC_VERSION_MAJOR >= 4
using RayContext = RTCRayQueryContext;
constexpr RTCSceneFlags kFilterInCall = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

void intersect(RTCScene scene, RayContext& context, RTCFilterFunctionN filter, RTCRayHit& ray) {
  rtcInitRayQueryContext(&context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context;
  arguments.filter = filter;
  if (filter) arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  rtcIntersect1(scene, &ray, &arguments);
}
void occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }
#else
using RayContext = RTCIntersectContext;
constexpr RTCSceneFlags kFilterInCall = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

void intersect(RTCScene scene, RayContext& context, RTCFilterFunctionN filter, RTCRayHit& ray) {
  rtcInitIntersectContext(&context);
  context.filter = filter;
  rtcIntersect1(scene, &context, &ray);
}
void occluded(RTCScene scene, RTCRay& ray) {
  RayContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
}
#endif

Vec3 on_edge(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 e = b - a;
  const double t = std::clamp(dot(p - a, e) / dot(e, e), 0.0, 1.0);
  return a + t * e;
}
// The point nearest to p of a triangle with area: the foot of the perpendicular, or on an edge.
Vec3 point_nearest(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = cross(b - a, c - a), w = p - a;
  const auto left_of = [&](const Vec3& q, const Vec3& r) {
    return dot(cross(r - q, p - q), n) >= 0;
  };
  if (left_of(a, b) && left_of(b, c) && left_of(c, a)) {
    const double h = dot(w, n) / dot(n, n);
    return p - h * n;
  }
  Vec3 best = on_edge(p, a, b);
  for (const Vec3& q : {on_edge(p, b, c), on_edge(p, c, a)})
    if (dot(p - q, p - q) < dot(p - best, p - best)) best = q;
  return best;
}

bool has_area(const Mesh& mesh, std::size_t t) {
  const auto& f = mesh.triangles[t];
  const Vec3& a = mesh.vertices[f[0]];
  const Vec3 u = mesh.vertices[f[1]] - a, v = mesh.vertices[f[2]] - a, n = cross(u, v);
  const double longest2 = std::max({dot(u, u), dot(v, v), dot(v - u, v - u)});
  return dot(n, n) > 1e-24 * longest2 * longest2;
}

// The triangles with area; only the first of those with the same three corners. A counting sort by
// each of the three sorted corners, the last one first, brings these together in their order. It
// takes the same time whatever the mesh is.
std::vector<std::uint32_t> that_count(const Mesh& mesh) {
  std::vector<std::array<std::uint32_t, 3>> corner(mesh.triangles.begin(), mesh.triangles.end());
  std::vector<std::uint32_t> order, next, end(mesh.vertices.size() + 1);
  for (std::uint32_t t = 0; t < corner.size(); ++t) {
    std::sort(corner[t].begin(), corner[t].end());
    if (has_area(mesh, t)) order.push_back(t);
  }
  next.resize(order.size());
  for (const std::size_t k : {2, 1, 0}) {
    std::fill(end.begin(), end.end(), 0);
    for (const std::uint32_t t : order) ++end[corner[t][k] + 1];
    std::partial_sum(end.begin(), end.end(), end.begin());
    for (const std::uint32_t t : order) next[end[corner[t][k]]++] = t;
    order.swap(next);
  }
  std::vector<bool> counts(corner.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    counts[order[i]] = i == 0 || corner[order[i]] != corner[order[i - 1]];
  std::vector<std::uint32_t> kept;
  for (std::uint32_t t = 0; t < corner.size(); ++t)
    if (counts[t]) kept.push_back(t);
  return kept;
}

constexpr double kSlack = 1e-6;  // of the cube's half side

}  // namespace

struct RayScene::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<std::uint32_t> triangle;  // (primitives) index in the mesh
  Vec3 middle{};
  double half = 1;  // [m] Embree's unit

  ~Embree() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  Vec3 inside(const Vec3& p) const {
    return {(p.x - middle.x) / half, (p.y - middle.y) / half, (p.z - middle.z) / half};
  }
  RTCRayHit ray(const Vec3& from, const Vec3& along) const {
    const Vec3 o = inside(from);
    RTCRayHit ray{};
    ray.ray.org_x = float(o.x), ray.ray.org_y = float(o.y), ray.ray.org_z = float(o.z);
    ray.ray.dir_x = float(along.x), ray.ray.dir_y = float(along.y), ray.ray.dir_z = float(along.z);
    ray.ray.tnear = 0;
    ray.ray.tfar = std::numeric_limits<float>::infinity();
    ray.ray.mask = ~0u;
    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return ray;
  }
};

RayScene::RayScene(const Mesh& mesh, std::unique_ptr<Embree> embree)
    : mesh_(mesh), embree_(std::move(embree)) {}
RayScene::~RayScene() = default;

Result<std::unique_ptr<RayScene>> RayScene::make(const Mesh& mesh) {
  const Failure no_memory{"not enough memory to shoot rays at this mesh: simplify it first"};
  auto e = std::make_unique<Embree>();
  e->device = rtcNewDevice(nullptr);
  if (!e->device) return no_memory;
  e->scene = rtcNewScene(e->device);
  rtcSetSceneFlags(e->scene, RTCSceneFlags(RTC_SCENE_FLAG_ROBUST | kFilterInCall));
  e->triangle = that_count(mesh);
  Vec3 low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};
  for (const std::uint32_t t : e->triangle)
    for (const std::uint32_t v : mesh.triangles[t]) {
      const Vec3& p = mesh.vertices[v];
      low = min(low, p);
      high = max(high, p);
    }
  if (!e->triangle.empty()) {
    e->middle = {(low.x + high.x) / 2, (low.y + high.y) / 2, (low.z + high.z) / 2};
    e->half = std::max({high.x - low.x, high.y - low.y, high.z - low.z}) / 2;
    RTCGeometry geometry = rtcNewGeometry(e->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    const std::size_t vertices = mesh.vertices.size(), triangles = e->triangle.size();
    auto* place = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), vertices));
    auto* corner = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), triangles));
    if (place && corner) {
      for (std::size_t v = 0; v < vertices; ++v) {
        const Vec3 p = e->inside(mesh.vertices[v]);
        place[3 * v] = float(p.x), place[3 * v + 1] = float(p.y), place[3 * v + 2] = float(p.z);
      }
      for (std::size_t i = 0; i < triangles; ++i)
        std::copy_n(mesh.triangles[e->triangle[i]].data(), 3, corner + 3 * i);
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(e->scene, geometry);
    }
    rtcReleaseGeometry(geometry);
    if (!place || !corner) return no_memory;
  }
  rtcCommitScene(e->scene);
  if (rtcGetDeviceError(e->device) != RTC_ERROR_NONE) return no_memory;
  return std::unique_ptr<RayScene>(new RayScene(mesh, std::move(e)));
}

RayScene::Near RayScene::nearest(const Vec3& place, double within) const {
  struct Search {
    const RayScene* self;
    double p[3];
    double best2;
    double slack;  // in Embree's unit
    std::uint32_t triangle = kNoTriangle;
    float radius() const {
      return float(std::sqrt(best2) / self->embree_->half * (1 + kSlack) + slack);
    }
  };
  if (embree_->triangle.empty()) return {};
  const Vec3 at = embree_->inside(place);
  const double slack = kSlack * std::max({1.0, std::fabs(at.x), std::fabs(at.y), std::fabs(at.z)});
  Search search{this, {place.x, place.y, place.z}, within * within, slack};
  RTCPointQuery query{};
  query.x = float(at.x), query.y = float(at.y), query.z = float(at.z);
  query.radius = search.radius();
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  const auto look = [](RTCPointQueryFunctionArguments* args) {
    auto& s = *static_cast<Search*>(args->userPtr);
    const Mesh& mesh = s.self->mesh_;
    const std::uint32_t t = s.self->embree_->triangle[args->primID];
    double c[3][3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& v = mesh.vertices[mesh.triangles[t][k]];
      c[k][0] = v.x, c[k][1] = v.y, c[k][2] = v.z;
    }
    const double d2 = kernels::point_triangle_squared(s.p, c[0], c[1], c[2]);
    // Embree proposes triangles in an order that depends on the threads that built its tree: ties
    // must not be won by order.
    const bool tie = d2 == s.best2 && s.triangle != kNoTriangle && t < s.triangle;
    if (!(d2 < s.best2) && !tie) return false;
    s.best2 = d2, s.triangle = t;
    args->query->radius = s.radius();
    return true;
  };
  rtcPointQuery(embree_->scene, &query, &context, look, &search);
  if (search.triangle == kNoTriangle) return {};
  const auto& f = mesh_.triangles[search.triangle];
  return {std::sqrt(search.best2), search.triangle,
          point_nearest(place, mesh_.vertices[f[0]], mesh_.vertices[f[1]], mesh_.vertices[f[2]])};
}

void RayScene::crossings(const Vec3& from, const Vec3& along, std::vector<Crossing>& all,
                         double within) const {
  struct Collect : RayContext {
    std::vector<std::uint32_t> found;
  } context;
  const auto collect_all = [](const RTCFilterFunctionNArguments* args) {
    for (unsigned i = 0; i < args->N; ++i) {
      if (args->valid[i] == 0) continue;
      auto* collect = static_cast<Collect*>(args->context);
      collect->found.push_back(RTCHitN_primID(args->hit, args->N, i));
      args->valid[i] = 0;  // the ray goes on
    }
  };
  RTCRayHit ray = embree_->ray(from, along);
  ray.ray.tfar = float(within / embree_->half * (1 + kSlack) + kSlack);
  intersect(embree_->scene, context, collect_all, ray);
  std::sort(context.found.begin(), context.found.end());
  context.found.erase(std::unique(context.found.begin(), context.found.end()), context.found.end());
  all.clear();
  for (const std::uint32_t i : context.found) {
    const std::uint32_t t = embree_->triangle[i];
    const auto& f = mesh_.triangles[t];
    const Vec3& a = mesh_.vertices[f[0]];
    const Vec3 n = cross(mesh_.vertices[f[1]] - a, mesh_.vertices[f[2]] - a);
    const double fall = dot(n, along);
    all.push_back({t, fall != 0 ? std::max(0.0, dot(n, a - from) / fall) : 0});
  }
  std::sort(all.begin(), all.end(), [](const Crossing& a, const Crossing& b) {
    return a.t != b.t ? a.t < b.t : a.triangle < b.triangle;
  });
}

bool RayScene::meets(const Vec3& from, const Vec3& along) const {
  RTCRayHit ray = embree_->ray(from, along);
  occluded(embree_->scene, ray.ray);
  return ray.ray.tfar < 0;
}

RayScene::Hit RayScene::first(const Vec3& from, const Vec3& along) const {
  RayContext context;
  RTCRayHit ray = embree_->ray(from, along);
  intersect(embree_->scene, context, nullptr, ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  return {embree_->triangle[ray.hit.primID], double(ray.ray.tfar) * embree_->half};
}

double RayScene::reach() const { return 5 * embree_->half; }

}  // namespace h6::io
