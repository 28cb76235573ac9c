// SPDX-License-Identifier: Apache-2.0
#include "io/run/start_overlap.h"

#include <cmath>
#include <cstdio>

#include "io/file/csv.h"
#include "io/mesh/mesh_file.h"

namespace h6::cli {
namespace {

std::vector<h6OverlapPoint> points_of(const h6Session* session) {
  std::vector<h6OverlapPoint> points(h6GetOverlapPoints(session, nullptr, 0));
  h6GetOverlapPoints(session, points.data(), points.size());
  return points;
}

const std::string& name_of(const io::LoadedScene& loaded, std::int32_t body) {
  return loaded.scene.bodies[static_cast<std::size_t>(body)].name;
}

// The part of the field's mesh that a point is in; empty when the field does not know it.
std::string mesh_part(const io::LoadedScene& loaded, const h6OverlapPoint& p) {
  const int field = loaded.bodies[static_cast<std::size_t>(p.field_body)].field;
  const auto& mesh = loaded.field_meshes[static_cast<std::size_t>(field)];
  const auto part = static_cast<std::size_t>(p.part);
  return p.part < 0 || !mesh || part >= mesh->mesh().part_names.size()
             ? ""
             : mesh->mesh().part_names[part];
}

// "1.6 voxels deep at (1, 2, 3) mm of 'with' (part)".
std::string depth_and_place(const PartOverlap& o, io::Unit unit) {
  const double scale = 1 / io::metres(unit);
  char text[160];
  std::snprintf(text, sizeof text, "%.2g voxels (%.3g %s) deep at (%.5g, %.5g, %.5g) %s",
                o.depth_voxels, o.depth * scale, io::unit_name(unit), o.place.x * scale,
                o.place.y * scale, o.place.z * scale, io::unit_name(unit));
  const bool named = !o.with_part.empty() && o.with_part != o.with;
  return text + (named ? " in '" + o.with_part + "'" : "");
}

std::string count(std::uint32_t points) {
  return std::to_string(points) + (points == 1 ? " point" : " points");
}

std::string sentence_of(const PartOverlap& o, const h6ContactDef& contact, io::Unit unit) {
  const std::string effect = o.relieved > 0                  ? "relieved until free"
                             : o.depth <= contact.fit_offset ? "within the play of fit_offset"
                             : contact.fit_offset > 0 ? "every depth beyond fit_offset pushes"
                                                      : "every depth pushes";
  return "'" + o.part + "' overlaps '" + o.with + "' at " + count(o.points) + ", " +
         depth_and_place(o, unit) + "; " + effect;
}

}  // namespace

std::vector<PartOverlap> start_overlaps(const io::LoadedScene& loaded, const h6ContactDef& contact,
                                        const h6Session* session) {
  std::vector<h6Overlap> pairs(h6GetOverlaps(session, nullptr, 0));
  h6GetOverlaps(session, pairs.data(), pairs.size());
  const std::vector<h6OverlapPoint> points = points_of(session);
  std::vector<PartOverlap> all;
  std::size_t row = 0;
  for (const h6Overlap& pair : pairs) {
    const h6OverlapPoint& deepest = points[pair.deepest];
    PartOverlap& o = all.emplace_back();
    o.part = name_of(loaded, pair.shell_body), o.with = name_of(loaded, pair.field_body);
    o.with_part = mesh_part(loaded, deepest);
    o.points = pair.points, o.relieved = pair.relieved;
    o.depth = pair.depth, o.depth_voxels = pair.depth_voxels;
    o.place = deepest.position;
    for (const std::size_t end = row + pair.points; row < end; ++row)
      o.unknown += std::isinf(points[row].relief);
    o.sentence = sentence_of(o, contact, loaded.scene.unit);
  }
  return all;
}

Outcome check_start(const std::vector<PartOverlap>& overlaps, io::Unit unit) {
  const PartOverlap* worst = nullptr;
  for (const PartOverlap& o : overlaps)
    if (o.unknown > 0 && (!worst || o.depth_voxels > worst->depth_voxels)) worst = &o;
  if (!worst) return Done{};
  char rule[120];
  std::snprintf(rule, sizeof rule,
                ": a depth beyond %g voxels, or beyond the field's band, is not known, and ",
                H6_DEEPEST_FIT);
  return Failure{"'" + worst->part + "' starts inside '" + worst->with + "', at least " +
                 depth_and_place(*worst, unit) + rule + std::to_string(worst->unknown) + " of " +
                 count(worst->points) +
                 " there would take no part; choose another pose, check the units of both parts, "
                 "take larger voxels, or let every depth push with \"contact\": {\"fit\": "
                 "\"tight\"}"};
}

std::string overlap_csv(const io::LoadedScene& loaded, const h6Session* session) {
  const double scale = 1 / io::metres(loaded.scene.unit);
  std::string out = "part,with,point,x,y,z,depth,depth_voxels,with_part,with_triangle\n";
  for (const h6OverlapPoint& p : points_of(session)) {
    char numbers[200];
    std::snprintf(numbers, sizeof numbers, ",%u,%.9g,%.9g,%.9g,%.9g,%.9g,", p.point,
                  p.position.x * scale, p.position.y * scale, p.position.z * scale, p.depth * scale,
                  p.depth_voxels);
    out += io::csv_quoted(name_of(loaded, p.shell_body)) + "," +
           io::csv_quoted(name_of(loaded, p.field_body)) + numbers +
           io::csv_quoted(mesh_part(loaded, p)) + "," +
           (p.triangle < 0 ? "" : std::to_string(p.triangle)) + "\n";
  }
  return out;
}

}  // namespace h6::cli
