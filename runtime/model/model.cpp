// SPDX-License-Identifier: Apache-2.0
// model.cpp - makes and destroys a model, and answers questions about it.
#include "runtime/model/model.h"

#include <algorithm>
#include <cmath>

#include "kernels/field/sample_field.h"

namespace h6 {

namespace {

constexpr std::size_t kMostParts = 65536;  // fields, and shells, of a model

template <class T>
T* make_array(const h6Allocator& allocator, std::size_t count) {
  T* array = static_cast<T*>(allocate(allocator, count * sizeof(T)));
  if (array)
    for (std::size_t i = 0; i < count; ++i) new (&array[i]) T();
  return array;
}
template <class T>
void drop_array(const h6Allocator& allocator, T* array, std::size_t count) {
  if (!array) return;
  for (std::size_t i = 0; i < count; ++i) array[i].~T();
  release(allocator, array, count * sizeof(T));
}

bool fill(h6Model& model, const h6ModelDef& def, h6Error* error) {
  if (!check_reserved(def, "", error)) return false;
  if ((def.field_count && !def.fields) || (def.shell_count && !def.shells))
    return fail(error, "the model definition counts fields or shells but points at none");
  if (def.field_count > kMostParts || def.shell_count > kMostParts)
    return fail(error, "a model has at most %zu fields and %zu shells, not %zu and %zu", kMostParts,
                kMostParts, def.field_count, def.shell_count);
  model.fields = make_array<Field>(def.allocator, def.field_count);
  if (def.field_count && !model.fields)
    return fail(error, H6_ERROR_MEMORY, "no memory for %zu fields", def.field_count);
  model.field_count = def.field_count;
  model.shells = make_array<Shell>(def.allocator, def.shell_count);
  if (def.shell_count && !model.shells)
    return fail(error, H6_ERROR_MEMORY, "no memory for %zu shells", def.shell_count);
  model.shell_count = def.shell_count;
  h6Error why;
  for (std::size_t i = 0; i < def.field_count; ++i)
    if (!convert_field(def.fields[i], def, &model.fields[i], &why))
      return fail(error, why.code, "field %zu: %s", i, why.message);
  for (std::size_t i = 0; i < def.shell_count; ++i)
    if (!convert_shell(def.shells[i], def.allocator, &model.shells[i], &why))
      return fail(error, why.code, "shell %zu: %s", i, why.message);
  return true;
}

}  // namespace
}  // namespace h6

using namespace h6;

extern "C" {

h6Model* h6CreateModel(const h6ModelDef* def, h6Error* error) {
  if (!def) return fail(error, "no model definition was given"), nullptr;
  h6Model* model = create<h6Model>(def->allocator);
  if (!model) return fail(error, H6_ERROR_MEMORY, "no memory for a model"), nullptr;
  model->allocator = def->allocator;
  if (fill(*model, *def, error)) return model;
  h6DestroyModel(model);
  return nullptr;
}

void h6DestroyModel(h6Model* model) {
  if (!model) return;
  const h6Allocator allocator = model->allocator;
  drop_array(allocator, model->fields, model->field_count);
  drop_array(allocator, model->shells, model->shell_count);
  destroy(allocator, model);
}

size_t h6ModelBytes(const h6Model* model) {
  if (!model) return 0;
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < model->field_count; ++i) bytes += model->fields[i].bytes();
  for (std::size_t i = 0; i < model->shell_count; ++i) bytes += model->shells[i].bytes();
  return bytes;
}

namespace {

constexpr std::size_t kSampled = 64;  // points at a time; a multiple of every vector length

// Whether a brick holds the place.
bool in_brick(const Field& field, const Vec3& p) {
  const Vec3 cell = ((p - field.origin) / (8 * field.voxel)).array().floor();
  const auto* n = field.view.size;
  for (int k = 0; k < 3; ++k)
    if (!(cell[k] >= 0 && cell[k] < n[k])) return false;
  const std::size_t at =
      (static_cast<std::size_t>(cell[2]) * n[1] + static_cast<std::size_t>(cell[1])) * n[0] +
      static_cast<std::size_t>(cell[0]);
  return field.view.table[at] >= 0;
}

// Samples up to kSampled points.
void sample_some(const Field& field, const double* points, std::size_t count, double* distance,
                 double* gradient) {
  const float scale = static_cast<float>(1.0 / field.voxel);
  // Points relative to the field's first node, in double: float then loses nothing that matters.
  const kernels::Affine to_field{{{scale, 0, 0, 0}, {0, scale, 0, 0}, {0, 0, scale, 0}}};
  alignas(64) float q[3][kSampled], d[kSampled], g[3][kSampled];
  for (std::size_t i = 0; i < count; ++i)
    for (int k = 0; k < 3; ++k)
      q[k][i] = static_cast<float>(points[3 * i + static_cast<std::size_t>(k)] - field.origin[k]);
  kernels::sample_field(field.view, to_field, {q[0], q[1], q[2], count}, nullptr, count, d,
                        gradient ? g[0] : nullptr, gradient ? g[1] : nullptr,
                        gradient ? g[2] : nullptr);
  for (std::size_t i = 0; i < count; ++i) distance[i] = d[i] * field.voxel;
  for (std::size_t i = 0; gradient && i < count; ++i) {
    Vec3 v(g[0][i], g[1][i], g[2][i]);
    const double n = v.norm();
    if (n > 0) v /= n;
    for (int k = 0; k < 3; ++k) gradient[3 * i + static_cast<std::size_t>(k)] = v[k];
  }
}

}  // namespace

int h6SampleField(const h6Model* model, int32_t index, const double* points, size_t count,
                  double* distance, double* gradient, uint8_t* exact) {
  if (!model || index < 0 || static_cast<std::size_t>(index) >= model->field_count ||
      (count && (!points || !distance)))
    return -1;
  const Field& field = model->fields[index];
  for (std::size_t i = 0; exact && i < count; ++i)
    exact[i] = in_brick(field, Vec3(points[3 * i], points[3 * i + 1], points[3 * i + 2]));
  for (std::size_t i = 0; i < count; i += kSampled)
    sample_some(field, points + 3 * i, std::min(kSampled, count - i), distance + i,
                gradient ? gradient + 3 * i : nullptr);
  return 0;
}

}  // extern "C"
