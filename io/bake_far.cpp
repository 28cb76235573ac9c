// bake_far.cpp - how far every eighth node is from the surface at least: Embree's closest-point
// query, with the distances themselves in double.
//
// The tree is in float. A triangle is pruned only when its box is farther than the best so far plus
// kSlack, which is more than float can be wrong by: so the nearest one is never missed, and the
// result does not depend on the tree or on the number of threads.
#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>

#include "io/bake_grid.h"
#include "sched/parallel_for.h"

namespace h6::io::bake {
namespace {

constexpr double kSlack = 4e-3;  // [voxel]; float at 2048 voxels: 2.4e-4

struct Query {
  const Surface* surface;
  double p[3];
  double best2;
};

bool visit_triangle(RTCPointQueryFunctionArguments* args) {
  Query& q = *static_cast<Query*>(args->userPtr);
  const std::array<std::uint32_t, 3>& t = q.surface->triangles[args->primID];
  const Vec3 &a = q.surface->vertices[t[0]], &b = q.surface->vertices[t[1]],
             &c = q.surface->vertices[t[2]];
  const double pa[3] = {a.x, a.y, a.z}, pb[3] = {b.x, b.y, b.z}, pc[3] = {c.x, c.y, c.z};
  const double d2 = kernels::point_triangle_squared(q.p, pa, pb, pc);
  if (d2 >= q.best2) return false;
  q.best2 = d2;
  args->query->radius = float(std::sqrt(d2) + kSlack);
  return true;
}

struct Scene {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Scene() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

// Without a thread count: Embree would impose it on all of the process's TBB.
bool build(const Surface& surface, const Grid& grid, Scene& scene) {
  scene.device = rtcNewDevice(nullptr);
  if (!scene.device) return false;
  scene.scene = rtcNewScene(scene.device);
  rtcSetSceneBuildQuality(scene.scene, RTC_BUILD_QUALITY_LOW);
  RTCGeometry geometry = rtcNewGeometry(scene.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, surface.vertices.size()));
  auto* index = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, surface.triangles.size()));
  if (!vertex || !index) {
    rtcReleaseGeometry(geometry);
    return false;
  }
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    const Vec3& v = surface.vertices[i];
    vertex[3 * i] = float(v.x - grid.middle(0));
    vertex[3 * i + 1] = float(v.y - grid.middle(1));
    vertex[3 * i + 2] = float(v.z - grid.middle(2));
  }
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) index[3 * i + k] = surface.triangles[i][k];
  rtcSetGeometryPointQueryFunction(geometry, visit_triangle);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene.scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene.scene);
  return rtcGetDeviceError(scene.device) == RTC_ERROR_NONE;
}

// What is known of node (8a, 8b, 8c) without a query; nodes past the last brick are outside.
struct Known {
  bool inside;
  const float* exact;  // signed, or null
};
Known look_up(const Grid& grid, const NarrowBand& band, const Reached& reached, int a, int b,
              int c) {
  if (a >= grid.bricks[0] || b >= grid.bricks[1] || c >= grid.bricks[2]) return {false, nullptr};
  const std::size_t cell = grid.cell(a, b, c);
  const std::int32_t r = band.row[cell];
  if (r < 0) return {reached.cell[cell] == 0, nullptr};
  return {!reached.node[std::size_t(r)].get(0), band.nodes(std::size_t(r))};
}

// A lower bound of the distance to the zero set, from u. Outside: u - offset. Inside the border of
// the reached region is at least sqrt(u^2 - offset^2) away: nearer only through a crack narrower
// than 2 offset, and that is how far the crack is.
double bound(double u, double offset, bool inside) {
  const double certain = u - kSlack - 1e-6 * u;
  if (!inside) return std::max(0.0, certain - offset);
  if (u <= offset) return std::max(0.0, offset - u - kSlack);
  return std::sqrt(std::max(0.0, certain * certain - offset * offset));
}

}  // namespace

Outcome far_distances(const Surface& surface, const Grid& grid, const NarrowBand& band,
                      const Reached& reached, unsigned threads, const Steps& steps,
                      std::vector<float>& far) {
  Scene scene;
  if (!build(surface, grid, scene))
    return Failure{"not enough memory for the search tree of the far field"};
  if (!steps.tell("far field", 0.88)) return Failure{"cancelled"};
  const int nx = grid.bricks[0] + 1, ny = grid.bricks[1] + 1, nz = grid.bricks[2] + 1;
  far.resize(std::size_t(nx) * std::size_t(ny) * std::size_t(nz));
  const bool whole = steps.run("far field", 0.88, 1.0, std::size_t(ny) * std::size_t(nz), threads,
                               [&](std::size_t line) {
    const int b = int(line % std::size_t(ny)), c = int(line / std::size_t(ny));
    double last = -1;  // u at the node before
    for (int a = 0; a < nx; ++a) {
      const Known known = look_up(grid, band, reached, a, b, c);
      Query query{&surface, {8.0 * a, 8.0 * b, 8.0 * c}, 0};
      const double start = last < 0 ? 1e5 : last + 8 + kSlack;
      query.best2 = start * start;
      RTCPointQuery point{float(query.p[0] - grid.middle(0)), float(query.p[1] - grid.middle(1)),
                          float(query.p[2] - grid.middle(2)), 0.0f, float(start + kSlack)};
      RTCPointQueryContext context;
      rtcInitPointQueryContext(&context);
      rtcPointQuery(scene.scene, &point, &context, nullptr, &query);
      last = std::sqrt(query.best2);
      const double u = bound(last, grid.offset, known.inside);
      far[line * std::size_t(nx) + std::size_t(a)] =
          float((known.inside ? -u : u) * grid.voxel * (1 - 1e-6));
    }
  });
  if (!whole) return Failure{"cancelled"};
  return Done{};
}

}  // namespace h6::io::bake
