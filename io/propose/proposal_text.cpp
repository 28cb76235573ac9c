// SPDX-License-Identifier: Apache-2.0
// proposal_text.cpp - a proposed scene as JSON that people read: only what is not a default.
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "io/propose/propose_scene.h"

namespace h6::io {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kWidth = 92;  // of a line

std::string on_one_line(const Json& value) {
  if (!value.is_structured()) return value.dump();
  std::string out;
  for (const auto& [key, member] : value.items())
    out += (out.empty() ? "" : ", ") + (value.is_object() ? Json(key).dump() + ": " : "") +
           on_one_line(member);
  return value.is_object() ? "{" + out + "}" : "[" + out + "]";
}

// Lists and objects that fit stand on one line, except the outermost.
std::string laid_out(const Json& value, std::size_t indent = 0) {
  const std::string flat = on_one_line(value);
  if (!value.is_structured() || (indent > 0 && indent + flat.size() <= kWidth)) return flat;
  const std::string inside(indent + 2, ' ');
  std::string out;
  for (const auto& [key, member] : value.items())
    out += (out.empty() ? "\n" : ",\n") + inside +
           (value.is_object() ? Json(key).dump() + ": " : "") + laid_out(member, indent + 2);
  out += "\n" + std::string(indent, ' ');
  return value.is_object() ? "{" + out + "}" : "[" + out + "]";
}

// Without the noise of conversions, and without ".0".
Json plain(double value) {
  const double near = rounded(value, 12);
  if (near == std::round(near) && std::abs(near) < 1e15) return static_cast<std::int64_t>(near);
  return near;
}
Json in_unit(double metres_long, Unit unit) { return plain(metres_long / metres(unit)); }

Json field_json(const FieldSource& field, const std::string& mesh, Unit unit) {
  Json out{{"mesh", mesh}};
  if (field.unit && *field.unit != unit) out["units"] = unit_name(*field.unit);
  if (field.bake.tolerance > 0)
    out["tolerance"] = in_unit(field.bake.tolerance, unit);
  else
    out["voxel_size"] = in_unit(field.bake.voxel_size, unit);
  if (field.bake.sign == SignMode::winding) out["sign"] = "winding";
  return out;
}

Json body_json(const SceneBody& body, const std::string& mesh, Unit unit) {
  Json out{{"name", body.name}};
  if (body.fixed) out["fixed"] = true;
  if (!body.fixed) out["mass"] = plain(body.mass);
  const h6Vec3& p = body.pose.p;
  if (p.x != 0 || p.y != 0 || p.z != 0)
    out["pose"] = {{"p", {in_unit(p.x, unit), in_unit(p.y, unit), in_unit(p.z, unit)}}};
  if (body.field) out["field"] = field_json(*body.field, mesh, unit);
  if (body.shell) {
    Json shell{{"mesh", mesh}};
    if (body.shell->unit && *body.shell->unit != unit)
      shell["units"] = unit_name(*body.shell->unit);
    shell["points"] = body.shell->bake.points;
    out["shell"] = shell;
  }
  return out;
}

}  // namespace

std::string proposal_text(const Scene& scene, const std::vector<std::string>& meshes,
                          const std::string& path) {
  Json out{{"hapsix", 1},
           {"name", scene.name},
           {"about", scene.about},
           {"units", unit_name(scene.unit)}};
  if (scene.up != UpAxis::z) out["up"] = up_axis_name(scene.up);
  out["bodies"] = Json::array();
  for (std::size_t i = 0; i < scene.bodies.size(); ++i)
    out["bodies"].push_back(body_json(scene.bodies[i], meshes[i], scene.unit));
  out["contact"] = {{"stiffness", plain(scene.contact.stiffness)}};
  out["coupling"] = {{"stiffness", plain(scene.coupling.stiffness)}};
  out["hands"] = Json::array();
  for (const SceneHand& hand : scene.hands)
    out["hands"].push_back({{"body", hand.body}, {"device", hand.device}, {"path", path}});
  return laid_out(out) + "\n";
}

std::string path_text(const Path& path, Unit unit) {
  std::string out = "t,x,y,z,qw,qx,qy,qz\n";
  for (const PathRow& row : path) {
    const h6Pose& pose = row.pose;
    const Json cells{
        plain(row.t),    in_unit(pose.p.x, unit), in_unit(pose.p.y, unit), in_unit(pose.p.z, unit),
        plain(pose.q.w), plain(pose.q.x),         plain(pose.q.y),         plain(pose.q.z)};
    std::string line;
    for (const Json& cell : cells) line += (line.empty() ? "" : ",") + cell.dump();
    out += line + "\n";
  }
  return out;
}

}  // namespace h6::io
