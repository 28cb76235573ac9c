// SPDX-License-Identifier: Apache-2.0
// bake_api.cpp - fields and shells from meshes and files, for C.
#include <algorithm>
#include <cmath>

#include "io/api/guard.h"
#include "io/api/objects.h"
#include "io/field/field_file.h"
#include "io/scene/cache.h"
#include "io/shell/bake_shell.h"
#include "io/shell/shell_file.h"
#include "runtime/base/foreign_enum.h"

using namespace h6;
using namespace h6::io;

namespace {

bool within(double x, double low, double high) { return x >= low && x <= high; }

Result<FieldBake> options_of(const h6FieldBakeDef& def) {
  const auto bad = [](const char* name, const char* range) {
    return Failure{std::string(name) + " must be " + range};
  };
  if (!within(def.voxels, 16, 2048)) return bad("voxels", "in 16..2048");
  if (!within(def.voxel_size, 0, 1e6)) return bad("voxel_size", "in 0..1e6 m");
  if (!within(def.tolerance, 0, 1e6)) return bad("tolerance", "in 0..1e6 m");
  if (!within(def.offset, -1e6, 1e6)) return bad("offset", "below 0, or in 0..1e6 m");
  if (!within(def.seal, 0, 1e6)) return bad("seal", "in 0..1e6 m");
  if (!within(def.weld, 0, 1)) return bad("weld", "in 0..1 voxel");
  if (!within(def.band_voxels, 1, kWidestBand)) return bad("band_voxels", "in 1..8");
  if (raw_number(def.sign) > H6_SIGN_WINDING) return bad("sign", "one of h6Sign");
  FieldBake bake;
  bake.voxels = def.voxels, bake.voxel_size = def.voxel_size, bake.tolerance = def.tolerance;
  bake.offset = def.offset < 0 ? -1 : def.offset;
  bake.sign = static_cast<SignMode>(def.sign);
  bake.cavities = def.hollow ? Cavities::hollow : Cavities::solid;
  bake.seal = def.seal, bake.weld = def.weld, bake.band_voxels = def.band_voxels;
  bake.threads = def.threads;
  return bake;
}

Result<ShellBake> options_of(const h6ShellBakeDef& def) {
  Result<FieldBake> field = options_of(def.field);
  if (!field) return field.failure();
  if (def.points < 1 || def.points > max_shell_points)
    return Failure{"points must be in 1..20000000"};
  if (!within(def.spacing, 0, 1e6)) return Failure{"spacing must be in 0..1e6 m"};
  if (!within(def.levels, 1, 16)) return Failure{"levels must be in 1..16"};
  if (std::max(raw_number(def.surface), raw_number(def.normals)) > H6_FROM_FIELD)
    return Failure{"surface and normals must be one of h6ShellFrom"};
  ShellBake bake;
  bake.points = def.points, bake.spacing = def.spacing, bake.levels = def.levels;
  bake.seed = def.seed;
  bake.surface = static_cast<ShellSurface>(def.surface);
  bake.normals = static_cast<ShellNormals>(def.normals);
  bake.field = *field;
  bake.threads = def.field.threads;
  return bake;
}

Result<FieldData> bake(const Mesh& mesh, const FieldBake& options, const h6FieldBakeDef& def) {
  const Progress progress = progress_of(def.progress, def.user);
  if (def.cache) {
    Cached cached;
    Result<FieldData> field = cached_field(HashedMesh(mesh), options, &cached, progress);
    log_all(cached.warnings);
    return field;
  }
  FieldBakeReport report;
  Result<FieldData> field = bake_field(mesh, options, &report, progress);
  log_all(report.warnings);
  if (field) field->input_hash = asset_key(HashedMesh(mesh), options);
  return field;
}

Result<ShellData> bake(const Mesh& mesh, const ShellBake& options, const h6FieldBakeDef& def) {
  const Progress progress = progress_of(def.progress, def.user);
  if (def.cache) {
    Cached cached;
    Result<ShellData> shell = cached_shell(HashedMesh(mesh), options, &cached, progress);
    log_all(cached.warnings);
    return shell;
  }
  std::vector<std::string> warnings;
  Result<ShellData> shell = bake_shell(mesh, options, &warnings, progress);
  log_all(warnings);
  if (shell) shell->input_hash = asset_key(HashedMesh(mesh), options);
  return shell;
}

template <class Api, class Def>
Api* bake_any(const h6Mesh* mesh, const Def& def, const h6FieldBakeDef& field, h6Error* error) {
  if (!mesh) return fill(error, H6_ERROR_ARGUMENT, "no mesh was given"), nullptr;
  if (!understood(def, error) || !understood(field, error)) return nullptr;
  return guarded(error, static_cast<Api*>(nullptr), [&]() -> Api* {
    const auto options = options_of(def);
    if (!options) return fill(error, H6_ERROR_RANGE, options.error()), nullptr;
    return wrap<Api>(bake(mesh->mesh, *options, field), H6_ERROR_CONTENT, error);
  });
}

template <class Api, class Read>
Api* read_any(const char* file, h6Error* error, Read&& read) {
  if (!file) return fill(error, H6_ERROR_ARGUMENT, "no file was given"), nullptr;
  return guarded(error, static_cast<Api*>(nullptr),
                 [&] { return wrap<Api>(read(file), reading(file), error); });
}

template <class Api, class Write>
bool write_any(const Api* object, const char* file, h6Error* error, Write&& write) {
  if (!object || !file)
    return fill(error, H6_ERROR_ARGUMENT, "something to write and a file are needed"), false;
  return guarded(error, false,
                 [&] { return finish(write(file, object->data), H6_ERROR_FILE, error); });
}

}  // namespace

extern "C" {

h6FieldBakeDef h6DefaultFieldBakeDef(void) {
  const FieldBake bake;
  h6FieldBakeDef def{};
  def.voxels = bake.voxels, def.offset = bake.offset, def.weld = bake.weld;
  def.band_voxels = bake.band_voxels;
  return def;
}
h6ShellBakeDef h6DefaultShellBakeDef(void) {
  const ShellBake bake;
  h6ShellBakeDef def{};
  def.points = bake.points, def.levels = bake.levels, def.seed = bake.seed;
  def.field = h6DefaultFieldBakeDef();
  return def;
}

h6Field* h6BakeField(const h6Mesh* mesh, const h6FieldBakeDef* def, h6Error* error) {
  const h6FieldBakeDef used = def ? *def : h6DefaultFieldBakeDef();
  return bake_any<h6Field>(mesh, used, used, error);
}
h6Shell* h6BakeShell(const h6Mesh* mesh, const h6ShellBakeDef* def, h6Error* error) {
  const h6ShellBakeDef used = def ? *def : h6DefaultShellBakeDef();
  return bake_any<h6Shell>(mesh, used, used.field, error);
}

h6Field* h6ReadField(const char* file, h6Error* error) {
  return read_any<h6Field>(file, error, [](const char* f) { return read_field(f); });
}
h6Shell* h6ReadShell(const char* file, h6Error* error) {
  return read_any<h6Shell>(file, error, [](const char* f) { return read_shell(f); });
}
bool h6WriteField(const h6Field* field, const char* file, h6Error* error) {
  return write_any(field, file, error,
                   [](const char* f, const FieldData& data) { return write_field(f, data); });
}
bool h6WriteShell(const h6Shell* shell, const char* file, h6Error* error) {
  return write_any(shell, file, error,
                   [](const char* f, const ShellData& data) { return write_shell(f, data); });
}
void h6DestroyField(h6Field* field) { delete field; }
void h6DestroyShell(h6Shell* shell) { delete shell; }

void h6GetField(const h6Field* field, h6FieldDef* out) {
  if (out) *out = field ? field->data.def() : h6FieldDef{};
}
void h6GetShell(const h6Shell* shell, h6ShellDef* out) {
  if (out) *out = shell ? shell->data.def() : h6ShellDef{};
}

}  // extern "C"
