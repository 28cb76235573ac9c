// SPDX-License-Identifier: Apache-2.0
#include "io/view/scene_drawing.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "io/mesh/mesh_file.h"
#include "io/shell/shell_file.h"

namespace h6::io::view {
namespace {

using nlohmann::ordered_json;

template <class Source>
std::optional<Mesh> mesh_of(const std::optional<Source>& source, Unit unit,
                            std::vector<std::string>& remarks) {
  if (!source) return std::nullopt;
  if (source->mesh_data) return weld(*source->mesh_data);
  if (source->mesh.empty()) return std::nullopt;
  Result<Mesh> mesh = read_mesh(source->mesh, source->unit.value_or(unit));
  if (mesh) return std::move(*mesh);
  remarks.push_back("not drawn: " + mesh.error());
  return std::nullopt;
}

// Field and shell of a body are mostly baked from the same mesh, so one of them is drawn.
std::optional<Mesh> mesh_of(const SceneBody& body, Unit unit, std::vector<std::string>& remarks) {
  if (auto mesh = mesh_of(body.shell, unit, remarks)) return mesh;
  return mesh_of(body.field, unit, remarks);
}

struct Drawn {
  std::vector<std::int16_t> position;
  std::vector<std::uint32_t> index;
  Vec3 origin{};
  double step = 0;
};

Drawn quantise(const Mesh& mesh) {
  Drawn out;
  const MeshBounds box = bounds_of(mesh);
  const double side = std::max(box.longest(), 1e-9);
  out.origin = box.low;
  out.step = side / 65535;
  const auto cell = [&](double x, double from) {
    return static_cast<std::int16_t>(std::lround((x - from) / out.step) - 32768);
  };
  out.position.reserve(3 * mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) {
    out.position.push_back(cell(v.x, box.low.x));
    out.position.push_back(cell(v.y, box.low.y));
    out.position.push_back(cell(v.z, box.low.z));
  }
  out.index.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) out.index.insert(out.index.end(), t.begin(), t.end());
  return out;
}

// Edges collapse within 1 % of the body's size. Soups consist of borders, which do not collapse;
// where too many triangles stay, vertices merge without regard to topology.
void simplify(Drawn& d, std::size_t triangles) {
  if (d.index.size() <= 3 * triangles) return;
  std::vector<float> points(d.position.begin(), d.position.end());
  const std::size_t vertices = points.size() / 3;
  std::vector<std::uint32_t> fewer(d.index.size());
  std::size_t count =
      meshopt_simplify(fewer.data(), d.index.data(), d.index.size(), points.data(), vertices,
                       3 * sizeof(float), 3 * triangles, 0.01f, 0, nullptr);
  if (count > 3 * triangles + triangles)
    count = meshopt_simplifySloppy(fewer.data(), d.index.data(), d.index.size(), points.data(),
                                   vertices, 3 * sizeof(float), 3 * triangles, 0.05f, nullptr);
  if (count == 0) return;  // nothing would be left: draw it in full
  fewer.resize(count);
  std::vector<std::uint32_t> place(vertices);
  const std::size_t left =
      meshopt_optimizeVertexFetchRemap(place.data(), fewer.data(), count, vertices);
  std::vector<std::int16_t> kept(3 * left);
  for (std::size_t v = 0; v < vertices; ++v)
    if (place[v] != ~0u)
      std::copy_n(d.position.begin() + static_cast<std::ptrdiff_t>(3 * v), 3,
                  kept.begin() + 3 * static_cast<std::ptrdiff_t>(place[v]));
  for (std::uint32_t& i : fewer) i = place[i];
  d.position.swap(kept);
  d.index.swap(fewer);
}

std::vector<float> points_of(const SceneBody& body, std::vector<std::string>& remarks) {
  std::vector<float> points;
  if (!body.shell) return points;
  const auto add = [&](double x, double y, double z) {
    points.insert(points.end(),
                  {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
  };
  if (body.shell->points) {
    const PointCloud& cloud = *body.shell->points;
    for (std::size_t i = 0; i < cloud.x.size(); ++i) add(cloud.x[i], cloud.y[i], cloud.z[i]);
  } else if (!body.shell->file.empty()) {
    const Result<ShellData> shell = read_shell(body.shell->file);
    if (!shell) {
      remarks.push_back("not drawn: " + shell.error());
      return points;
    }
    for (std::size_t i = 0; i < shell->size(); ++i) add(shell->x[i], shell->y[i], shell->z[i]);
  }
  return points;
}

std::vector<h6Vec3> vertices_of(const Drawn& d) {
  std::vector<h6Vec3> points;
  for (std::size_t v = 0; v < d.position.size(); v += 3)
    points.push_back({d.origin.x + d.step * (d.position[v] + 32768),
                      d.origin.y + d.step * (d.position[v + 1] + 32768),
                      d.origin.z + d.step * (d.position[v + 2] + 32768)});
  return points;
}

// 16 bits each, in steps of `step`.
std::vector<std::int16_t> packed(const std::vector<double>& values, double& step) {
  double most = 1e-30;
  for (const double v : values) most = std::max(most, std::fabs(v));
  step = most / 32767;
  std::vector<std::int16_t> out;
  out.reserve(values.size());
  for (const double v : values) out.push_back(static_cast<std::int16_t>(std::lround(v / step)));
  return out;
}

// Displacements and turns of the drawn vertices for each mode: (vertices x r x 3).
void add_modes(const Drawn& d, const ReducedModel& model, const std::string& number,
               Envelope& envelope, ordered_json& head) {
  const std::vector<h6Vec3> points = vertices_of(d);
  double step = 0;
  envelope.add("modes" + number, packed(modes_at(model, points), step));
  head["modes"] = model.modes;
  head["mode_step"] = step;
  if (model.turn.empty()) return;
  envelope.add("turns" + number, packed(turns_at(model, points), step));
  head["turn_step"] = step;
}

ordered_json pose_json(const h6Pose& p) {
  return {p.p.x, p.p.y, p.p.z, p.q.w, p.q.x, p.q.y, p.q.z};
}

}  // namespace

ordered_json draw_scene(const LoadedScene& loaded, const DrawLimits& limits, Envelope& envelope,
                        std::vector<std::string>& remarks) {
  const Scene& scene = loaded.scene;
  std::vector<std::optional<Drawn>> drawn(scene.bodies.size());
  std::size_t total = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i)
    if (const auto mesh = mesh_of(scene.bodies[i], scene.unit, remarks);
        mesh && !mesh->triangles.empty()) {
      drawn[i] = quantise(*mesh);
      total += mesh->triangles.size();
    }
  ordered_json bodies = ordered_json::array();
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const SceneBody& body = scene.bodies[i];
    const h6Vec3& com = loaded.bodies[i].com;
    ordered_json head{{"name", body.name},
                      {"fixed", body.fixed},
                      {"pose", pose_json(body.pose)},
                      {"com", {com.x, com.y, com.z}}};
    const std::string number = std::to_string(i);
    if (drawn[i]) {
      Drawn& d = *drawn[i];
      const std::size_t own = d.index.size() / 3;
      if (total > limits.triangles)  // bodies are cut by the same factor, but none below 2,000
        simplify(d, std::max<std::size_t>(2000, own * limits.triangles / total));
      if (d.index.size() / 3 < own)
        remarks.push_back("'" + body.name + "' is drawn with " +
                          std::to_string(d.index.size() / 3) + " of its " + std::to_string(own) +
                          " triangles");
      head["origin"] = {d.origin.x, d.origin.y, d.origin.z};
      head["step"] = d.step;
      envelope.add("position" + number, d.position);
      envelope.add("index" + number, d.index);
      if (const auto& model = loaded.bends[i]) add_modes(d, *model, number, envelope, head);
      d = {};
    } else if (const auto points = points_of(body, remarks); !points.empty()) {
      envelope.add("points" + number, points);
    }
    bodies.push_back(head);
  }
  double voxel = 0;
  for (const LoadedAsset& a : loaded.assets)
    if (a.is_field && (voxel == 0 || a.finest < voxel)) voxel = a.finest;
  return {{"name", scene.name},
          {"unit", unit_name(scene.unit)},
          {"per_metre", 1 / metres(scene.unit)},
          {"up", up_axis_name(scene.up)},
          {"voxel", voxel > 0 ? voxel : 1e-3},
          {"hand_body", loaded.hands.empty() ? -1 : loaded.hands[0].body},
          {"bodies", bodies}};
}

}  // namespace h6::io::view
