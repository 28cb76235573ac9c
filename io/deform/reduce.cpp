// SPDX-License-Identifier: Apache-2.0
#include "io/deform/reduce.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>
#include <numbers>

#include "io/deform/basis.h"
#include "io/deform/polynomials.h"
#include "io/file/content_hash.h"

namespace h6::io {
namespace {

using Clock = std::chrono::steady_clock;
using Eigen::Index;

// Above this the factor of a solid block no longer fits the memory of ordinary machines.
constexpr std::size_t kMostVertices = 300000;

Outcome check_options(const SolidMesh& mesh, const ReduceOptions& o) {
  if (o.modes < 1 || o.modes > static_cast<int>(kMostModes))
    return Failure{"A reduced model has 1 to " + std::to_string(kMostModes) + " modes, not " +
                   std::to_string(o.modes) + "."};
  if (o.linear_modes < 0 || o.linear_modes > static_cast<int>(kMostModes))
    return Failure{"The basis is made of 1 to " + std::to_string(kMostModes) +
                   " linear modes, not " + std::to_string(o.linear_modes) + "."};
  if (o.warp && o.linear_modes > 0)
    return Failure{"A warped model is made of linear modes alone: give their count by the modes."};
  if (!(o.damping >= 0 && o.damping <= 1))
    return Failure{"The damping is a share of the critical one, 0 to 1."};
  if (mesh.vertices.size() > kMostVertices)
    return Failure{"The model has " + std::to_string(mesh.vertices.size()) + " vertices, at most " +
                   std::to_string(kMostVertices) + " can be reduced; make it of larger elements."};
  return Done{};
}

// Mode 1 moves a vertex by a fifth of the model's longest side: far into what a linear model gets
// wrong, and not beyond what the material law is good for.
double amplitude_of(const SolidMesh& mesh, const deform::Dofs& dofs, const Eigen::VectorXd& mode) {
  h6Vec3 low = mesh.vertices[0], high = low;
  double most = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    low = min(low, mesh.vertices[v]), high = max(high, mesh.vertices[v]);
    if (dofs.first[v] >= 0) most = std::max(most, mode.segment<3>(dofs.first[v]).norm());
  }
  return 0.2 * std::max({high.x - low.x, high.y - low.y, high.z - low.z}) / most;
}

void put_basis(const Eigen::MatrixXd& shape, const Eigen::VectorXd& eigenvalue,
               const deform::Dofs& dofs, ReducedModel& model) {
  const auto r = static_cast<std::size_t>(shape.cols());
  model.basis.assign(model.mesh.vertices.size() * r * 3, 0);
  for (std::size_t v = 0; v < model.mesh.vertices.size(); ++v) {
    const std::int32_t first = dofs.first[v];
    if (first < 0) continue;
    for (std::size_t j = 0; j < r; ++j)
      for (int a = 0; a < 3; ++a)
        model.basis[(v * r + j) * 3 + a] = shape(first + a, static_cast<Index>(j));
  }
  for (std::size_t j = 0; j < r; ++j)
    model.frequency.push_back(std::sqrt(std::max(0.0, eigenvalue[static_cast<Index>(j)])) /
                              (2 * std::numbers::pi));
}

// Alpha / (2 w) + beta w / 2 is `ratio` at the lowest mode's w, and more above it.
void put_damping(double ratio, ReducedModel& model) {
  const double w = 2 * std::numbers::pi * model.frequency[0];
  model.mass_damping = ratio * w;
  model.stiffness_damping = ratio / w;
}

class Stages {
 public:
  explicit Stages(ReduceReport& report) : report_(report) {}
  void done(const char* name) {
    const Clock::time_point now = Clock::now();
    report_.stages.push_back({name, std::chrono::duration<double>(now - last_).count()});
    last_ = now;
  }

 private:
  ReduceReport& report_;
  Clock::time_point last_ = Clock::now();
};

// Linear modes, whose turns warp them.
ReducedModel warped_model(const SolidMesh& mesh, const deform::Dofs& dofs,
                          const deform::LinearModes& modes, const ReduceOptions& options) {
  ReducedModel model;
  model.mesh = mesh;
  const auto r = static_cast<std::size_t>(modes.shape.cols());
  model.modes = r;
  model.linear.assign(r * r, 0);
  for (std::size_t j = 0; j < r; ++j)
    model.linear[j * r + j] = modes.eigenvalue[static_cast<Index>(j)];
  put_basis(modes.shape, modes.eigenvalue, dofs, model);
  model.turn = vertex_turns(mesh, model.basis, r);
  put_damping(options.damping, model);
  model.free = options.free;
  model.input_hash = reduction_key(mesh, options);
  return model;
}

Result<ReducedModel> reduce_checked(const SolidMesh& mesh, const ReduceOptions& options,
                                    ReduceReport& report, Pulse& pulse) {
  const Failure cancelled{"cancelled"};
  const deform::Dofs dofs = deform::free_dofs(mesh);
  report.freedoms = static_cast<std::size_t>(dofs.count);
  const Index rest = dofs.count - (options.free ? 6 : 0);
  if (rest < options.modes)
    return Failure{"The model has only " + std::to_string(std::max<Index>(0, rest)) +
                   " degrees of freedom; ask for fewer modes."};
  const Index linear = std::min<Index>(rest, options.warp           ? options.modes
                                             : options.linear_modes ? options.linear_modes
                                                                    : std::min(options.modes, 20));
  Stages stages(report);

  if (!pulse.step("factoring the stiffness", 0, 0.2)) return cancelled;
  deform::Pencil pencil;
  if (Outcome good = deform::factorize(mesh, dofs, options.free, pencil); !good)
    return good.failure();
  stages.done("factor");
  if (!pulse.step("finding the modes", 0.2, 0.4)) return cancelled;
  Result<deform::LinearModes> modes = deform::linear_modes(pencil, linear, options.free, pulse);
  if (!modes) return modes.failure();
  stages.done("modes");
  if (options.warp) {
    ReducedModel model = warped_model(mesh, dofs, *modes, options);
    report.captured = 1;
    stages.done("turns");
    return model;
  }
  if (!pulse.step("deriving the modes", 0.4, 0.6)) return cancelled;
  Eigen::MatrixXd derivatives = deform::modal_derivatives(mesh, dofs, pencil, *modes, pulse);
  stages.done("derivatives");
  if (!pulse.step("choosing the basis", 0.6, 0.7)) return cancelled;
  const double amplitude = amplitude_of(mesh, dofs, modes->shape.col(0));
  Result<deform::Basis> basis =
      deform::principal_basis(pencil, *modes, derivatives, amplitude, options.modes, pulse);
  if (!basis) return basis.failure();
  report.captured = basis->captured;
  derivatives.resize(0, 0);
  stages.done("basis");
  if (!pulse.step("making the polynomials", 0.7, 1)) return cancelled;
  ReducedModel model;
  model.mesh = mesh;
  if (!deform::make_polynomials(mesh, dofs, basis->shape, options.threads, model, pulse))
    return cancelled;
  put_basis(basis->shape, basis->eigenvalue, dofs, model);
  put_damping(options.damping, model);
  model.free = options.free;
  model.input_hash = reduction_key(mesh, options);
  stages.done("polynomials");
  return model;
}

}  // namespace

std::string reduction_key(const SolidMesh& mesh, const ReduceOptions& o) {
  constexpr int kReducer = 1;  // another number when the same input gives other results
  std::string bytes;
  const auto put = [&](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(kReducer), put(o.modes), put(o.linear_modes), put(int{o.free}), put(o.damping);
  if (o.warp) put('w');
  put(mesh.vertices.size()), put(mesh.elements.size()), put(mesh.materials.size());
  for (const h6Vec3& p : mesh.vertices) put(p);
  for (const SolidElement& e : mesh.elements) put(e);
  for (const SolidMaterial& m : mesh.materials) put(m.young), put(m.poisson), put(m.density);
  for (const std::uint32_t v : mesh.fixed) put(v);
  return hex(hash_bytes(bytes.data(), bytes.size()));
}

Result<ReducedModel> reduce(const SolidMesh& mesh, const ReduceOptions& options,
                            ReduceReport* report, const Progress& progress) {
  if (Outcome good = check_options(mesh, options); !good) return good.failure();
  const Result<SolidFacts> facts = check_solid(mesh, options.free);
  if (!facts) return facts.failure();
  ReduceReport unheard;
  ReduceReport& out = report ? *report : unheard;
  out = {};
  out.facts = *facts;
  Pulse pulse(progress);
  try {
    return reduce_checked(mesh, options, out, pulse);
  } catch (const std::bad_alloc&) {
    return Failure{"There is not enough memory to reduce the model; make it of larger elements."};
  }
}

}  // namespace h6::io
