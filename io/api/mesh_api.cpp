// SPDX-License-Identifier: Apache-2.0
// mesh_api.cpp - meshes from memory and from files, for C.
#include <algorithm>
#include <cmath>
#include <map>

#include "io/api/guard.h"
#include "io/api/objects.h"
#include "io/mesh/mesh_file.h"
#include "runtime/base/foreign_enum.h"

using namespace h6;
using namespace h6::io;

namespace {

constexpr double kFarthest = 1e6;  // [m]

bool is_unit(const h6Unit& unit) { return raw_number(unit) <= H6_INCHES; }

Result<Mesh> take(const h6MeshDef& def) {
  if (!def.vertices || !def.triangles || def.triangle_count == 0)
    return Failure{"a mesh needs vertices and triangles"};
  if (def.vertex_count > UINT32_MAX || def.triangle_count > UINT32_MAX / 3)
    return Failure{"a mesh has at most 4294967295 vertices and 1431655765 triangles"};
  Mesh mesh;
  mesh.vertices.reserve(def.vertex_count);
  for (std::size_t i = 0; i < def.vertex_count; ++i) {
    const double* p = def.vertices + 3 * i;
    if (!(std::fabs(p[0]) <= kFarthest && std::fabs(p[1]) <= kFarthest &&
          std::fabs(p[2]) <= kFarthest))
      return Failure{"vertex " + std::to_string(i) + " is not within 1e6 m"};
    mesh.vertices.push_back({p[0], p[1], p[2]});
  }
  mesh.triangles.reserve(def.triangle_count);
  for (std::size_t i = 0; i < def.triangle_count; ++i) {
    const std::uint32_t* t = def.triangles + 3 * i;
    if (std::max({t[0], t[1], t[2]}) >= def.vertex_count)
      return Failure{"triangle " + std::to_string(i) + " names a vertex that does not exist"};
    mesh.triangles.push_back({t[0], t[1], t[2]});
  }
  if (def.part) {
    std::map<std::int32_t, std::int32_t> names;
    for (std::size_t i = 0; i < def.triangle_count; ++i) {
      if (def.part[i] < 0) return Failure{"part[" + std::to_string(i) + "] is below 0"};
      const auto [at, fresh] =
          names.try_emplace(def.part[i], static_cast<std::int32_t>(names.size()));
      if (fresh) mesh.part_names.push_back(std::to_string(def.part[i]));
      mesh.part.push_back(at->second);
    }
  }
  return weld(mesh);
}

h6Mesh* made(Result<Mesh> mesh, h6ErrorCode code, h6Error* error) {
  if (mesh) log_all(mesh->remarks);
  return wrap<h6Mesh>(std::move(mesh), code, error);
}

}  // namespace

extern "C" {

h6MeshDef h6DefaultMeshDef(void) { return {}; }

h6Mesh* h6CreateMesh(const h6MeshDef* def, h6Error* error) {
  if (!def) return fill(error, H6_ERROR_ARGUMENT, "no mesh definition was given"), nullptr;
  if (!understood(*def, error)) return nullptr;
  return guarded(error, static_cast<h6Mesh*>(nullptr),
                 [&] { return made(take(*def), H6_ERROR_ARGUMENT, error); });
}

h6Mesh* h6ReadMesh(const char* file, h6Unit unit, h6Error* error) {
  if (!file || !is_unit(unit))
    return fill(error, H6_ERROR_ARGUMENT, "a file and a unit are needed"), nullptr;
  return guarded(error, static_cast<h6Mesh*>(nullptr), [&] {
    return made(read_mesh(file, static_cast<Unit>(unit)), reading(file), error);
  });
}

h6Mesh* h6ParseMesh(const void* bytes, size_t count, const char* name, h6Unit unit,
                    h6Error* error) {
  if (!bytes || count > PTRDIFF_MAX || !name || !is_unit(unit))
    return fill(error, H6_ERROR_ARGUMENT, "bytes, a name and a unit are needed"), nullptr;
  return guarded(error, static_cast<h6Mesh*>(nullptr), [&] {
    const std::string text(static_cast<const char*>(bytes), count);
    return made(parse_mesh(text, name, static_cast<Unit>(unit)), H6_ERROR_CONTENT, error);
  });
}

void h6DestroyMesh(h6Mesh* mesh) { delete mesh; }

void h6GetMesh(const h6Mesh* mesh, h6MeshInfo* out) {
  if (!out) return;
  *out = {};
  if (!mesh) return;
  guarded(nullptr, false, [&] {
    const MeshAudit a = audit(mesh->mesh);
    *out = {a.triangles,
            a.vertices,
            std::max<std::size_t>(1, mesh->mesh.part_names.size()),
            a.duplicates,
            a.degenerate,
            a.open_edges,
            a.odd_edges,
            a.components,
            a.closed,
            a.low,
            a.high,
            a.volume,
            {}};
    return true;
  });
}

const char* h6GetPartName(const h6Mesh* mesh, int32_t part) {
  if (!mesh || part < 0 || static_cast<std::size_t>(part) >= mesh->mesh.part_names.size())
    return nullptr;
  return mesh->mesh.part_names[static_cast<std::size_t>(part)].c_str();
}

}  // extern "C"
