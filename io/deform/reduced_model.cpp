// SPDX-License-Identifier: Apache-2.0
#include "io/deform/reduced_model.h"

#include <algorithm>
#include <cmath>

namespace h6::io {
namespace {

bool finite(const std::vector<double>& values, std::size_t count) {
  return values.size() == count &&
         std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

bool consistent_mesh(const SolidMesh& mesh) {
  for (const h6Vec3& p : mesh.vertices)
    if (!std::isfinite(p.x + p.y + p.z)) return false;
  for (const SolidElement& e : mesh.elements) {
    if ((e.corners != 4 && e.corners != 8) || e.material >= mesh.materials.size()) return false;
    for (std::uint32_t a = 0; a < e.corners; ++a)
      if (e.corner[a] >= mesh.vertices.size()) return false;
  }
  for (std::size_t i = 0; i < mesh.fixed.size(); ++i)
    if (mesh.fixed[i] >= mesh.vertices.size() || (i > 0 && mesh.fixed[i] <= mesh.fixed[i - 1]))
      return false;
  return !mesh.elements.empty();
}

}  // namespace

void reduced_force(const ReducedModel& model, const double* q, double* force) {
  const std::size_t r = model.modes;
  if (!model.turn.empty()) {
    for (std::size_t i = 0; i < r; ++i) {
      force[i] = 0;
      for (std::size_t j = 0; j < r; ++j) force[i] += model.linear[i * r + j] * q[j];
    }
    return;
  }
  for (std::size_t i = 0; i < r; ++i) {
    const double* p1 = model.linear.data() + i * r;
    const double* p2 = model.quadratic.data() + i * pair_count(r);
    const double* p3 = model.cubic.data() + i * triple_count(r);
    double sum = 0;
    for (std::size_t j = 0; j < r; ++j) {
      double inner = *p1++;
      for (std::size_t k = j; k < r; ++k) {
        double innermost = *p2++;
        for (std::size_t l = k; l < r; ++l) innermost += *p3++ * q[l];
        inner += innermost * q[k];
      }
      sum += inner * q[j];
    }
    force[i] = sum;
  }
}

void reduced_stiffness(const ReducedModel& model, const double* q, double* stiffness) {
  const std::size_t r = model.modes;
  if (!model.turn.empty()) {
    std::copy(model.linear.begin(), model.linear.end(), stiffness);
    return;
  }
  for (std::size_t i = 0; i < r; ++i) {
    const double* p1 = model.linear.data() + i * r;
    const double* p2 = model.quadratic.data() + i * pair_count(r);
    const double* p3 = model.cubic.data() + i * triple_count(r);
    double* row = stiffness + i * r;
    std::copy(p1, p1 + r, row);
    for (std::size_t j = 0; j < r; ++j)
      for (std::size_t k = j; k < r; ++k) {
        const double two = *p2++;
        row[j] += two * q[k];
        row[k] += two * q[j];
        for (std::size_t l = k; l < r; ++l) {
          const double three = *p3++;
          row[j] += three * q[k] * q[l];
          row[k] += three * q[j] * q[l];
          row[l] += three * q[j] * q[k];
        }
      }
  }
}

bool consistent(const ReducedModel& model) {
  const std::size_t r = model.modes, n = model.mesh.vertices.size();
  const bool warps = !model.turn.empty();
  return r >= 1 && r <= kMostModes && consistent_mesh(model.mesh) &&
         finite(model.basis, n * r * 3) && finite(model.linear, r * r) &&
         finite(model.turn, warps ? n * r * 3 : 0) &&
         finite(model.quadratic, warps ? 0 : r * pair_count(r)) &&
         finite(model.cubic, warps ? 0 : r * triple_count(r)) && finite(model.frequency, r) &&
         std::isfinite(model.mass_damping) && std::isfinite(model.stiffness_damping);
}

}  // namespace h6::io
