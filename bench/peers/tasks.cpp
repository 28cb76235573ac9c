// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/tasks.h"

#include <algorithm>
#include <numeric>
#include <random>

#include "hapsix/vector.h"
#include "io/bake/bake_field.h"
#include "io/scenes/industrial/forced_path.h"
#include "io/scenes/scenes.h"

namespace h6::peers {
namespace {

constexpr std::size_t kPoses = 1000;

struct SessionDeleter {
  void operator()(h6Session* s) const { h6DestroySession(s); }
};

struct Kind {
  const char* name;
  const char* about;
  const char* scene;
  int refine;       // how often the edges of both meshes are halved, for the peers of triangles
  double softness;  // contacts are softer than the scene's by this factor while poses are recorded
};

// The engine holds parts within half a voxel of the field's surface. In the engine bay that surface
// is 0.9 voxel outside the triangles, so that with the scene's stiffness no triangles would cross
// and the peers of triangles would have nothing to find.
constexpr Kind kKinds[] = {
    {"starter", "the starter motor forced into its engine bay", "engine-bay", 0, 10},
    {"alpha", "the alpha forced at its shortcut, edges halved twice", "alpha-shortcut", 2, 1},
    {"alpha-fine", "the same, edges halved until corners are as many as points", "alpha-shortcut",
     3, 1},
    {"spline", "a splined shaft that carries torque in its hub", "spline-hub-10k", 0, 1},
};

// Every triangle in four, on the same surface.
io::Mesh halved(const io::Mesh& mesh) {
  io::Mesh out;
  for (const auto& t : mesh.triangles) {
    h6Vec3 v[6];
    for (std::size_t i = 0; i < 3; ++i) v[i] = mesh.vertices[t[i]];
    for (std::size_t i = 0; i < 3; ++i) v[3 + i] = 0.5 * (v[i] + v[(i + 1) % 3]);
    const auto first = static_cast<std::uint32_t>(out.vertices.size());
    out.vertices.insert(out.vertices.end(), v, v + 6);
    for (const auto& [a, b, c] :
         {std::array<std::uint32_t, 3>{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}})
      out.triangles.push_back({first + a, first + b, first + c});
  }
  return io::weld(out);
}

std::uint64_t spread_bits(std::uint64_t v) {  // 21 bits, three apart
  v = (v | v << 32) & 0x1f00000000ffff, v = (v | v << 16) & 0x1f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f, v = (v | v << 4) & 0x10c30c30c30c30c3;
  return (v | v << 2) & 0x1249249249249249;
}

void sort_points(Task& task) {
  const std::vector<h6Vec3>& all = task.scene->watched_points();
  h6Vec3 low = all[0];
  for (const h6Vec3& p : all) low = min(low, p);
  std::vector<std::uint64_t> code;
  for (const h6Vec3& p : all) {
    const h6Vec3 v = (1 / task.field.voxel_size) * (p - low);
    const auto bits = [](double x) { return spread_bits(static_cast<std::uint64_t>(x)); };
    code.push_back(bits(v.x) | bits(v.y) << 1 | bits(v.z) << 2);
  }
  task.order.resize(all.size());
  std::iota(task.order.begin(), task.order.end(), 0u);
  std::sort(task.order.begin(), task.order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return code[a] != code[b] ? code[a] < code[b] : a < b;
  });
  for (const std::uint32_t i : task.order) task.points.push_back(all[i]);
}

// The body's poses in consecutive frames, from the first that touches on.
std::vector<h6Pose> touching_poses(const io::LoadedScene& scene, double softness) {
  const io::Path& path = scene.scene.hands[0].path;
  h6SessionDef def = scene.session_def();
  std::vector<h6HandDef> hands = scene.hands;
  if (!(hands[0].coupling.max_force > 0))  // it would be derived from the softer contacts
    hands[0].coupling.max_force =
        def.contact.stiffness * hands[0].coupling.max_depth_voxels * scene.field_voxels[0];
  def.hands = hands.data();
  def.contact.stiffness /= softness;
  def.rate = 1000;
  std::unique_ptr<h6Session, SessionDeleter> session(
      h6CreateSession(scene.model.get(), &def, nullptr));
  std::vector<h6Pose> out;
  const h6Pose at = scene.bodies[0].pose;
  const h6Pose back{rotate(conjugate(at.q), -at.p), conjugate(at.q)};
  for (int i = 0; session && i < static_cast<int>(1000 * path.back().t); ++i) {
    h6DeviceSample sample{};
    sample.pose = io::sample_path(path, 1e-3 * i);
    sample.velocity = io::sample_path_velocity(path, 1e-3 * i);
    h6Step(session.get(), &sample, nullptr);
    if (out.empty() && h6GetFrame(session.get()).contacts == 0) continue;
    const h6Pose pose = h6GetBody(session.get(), 1).pose;
    out.push_back({place(back, pose.p), product(back.q, pose.q)});
    if (out.size() == kPoses) break;
  }
  return out;
}

}  // namespace

std::vector<std::string> task_names() {
  std::vector<std::string> out;
  for (const Kind& kind : kKinds) out.push_back(kind.name);
  return out;
}

Result<std::unique_ptr<Task>> make_task(const std::string& name) {
  const auto kind = std::find_if(std::begin(kKinds), std::end(kKinds),
                                 [&](const Kind& k) { return name == k.name; });
  if (kind == std::end(kKinds)) return Failure{"there is no task named " + name};
  auto scene = io::make_scene(kind->scene);
  if (!scene) return scene.failure();
  if (name == "starter") scene->hands[0].path = io::forced_path(io::starter_way_in(), 0);
  auto task = std::make_unique<Task>();
  task->name = kind->name, task->about = kind->about;
  task->obstacle = io::weld(*scene->bodies[0].field->mesh_data);
  task->part = io::weld(*scene->bodies[1].shell->mesh_data);
  auto field =
      io::bake_field(*scene->bodies[0].field->mesh_data, scene->bodies[0].field->bake, nullptr);
  if (!field) return field.failure();
  task->field = std::move(*field);
  for (int i = 0; i < kind->refine; ++i)
    task->obstacle = halved(task->obstacle), task->part = halved(task->part);
  auto loaded = io::load_scene(std::move(*scene));
  if (!loaded) return loaded.failure();
  task->scene = std::move(*loaded);
  sort_points(*task);
  task->path = touching_poses(*task->scene, kind->softness);
  if (task->path.size() < kPoses) return Failure{"the part of " + name + " touches too late"};
  task->shuffled = task->path;
  std::mt19937_64 engine(1);
  for (std::size_t i = kPoses - 1; i > 0; --i)
    std::swap(task->shuffled[i], task->shuffled[engine() % (i + 1)]);
  return task;
}

}  // namespace h6::peers
