// SPDX-License-Identifier: Apache-2.0
// A cantilever against beam theory for small loads and the full model for large ones.
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "io/deform/reduce.h"
#include "io/deform/stvk.h"
#include "tests/io/deform/solids.h"

using namespace h6;
using namespace h6::io;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kLength = 0.5, kSide = 0.05;  // [m]
constexpr SolidMaterial kSteel{"steel", 2e11, 0.0, 7850}, kRubbery{"rubber", 1e7, 0.3, 1000};

SolidMesh cantilever(const std::array<int, 3>& cells, const SolidMaterial& material) {
  SolidMesh mesh = solids::block({kLength, kSide, kSide}, cells, material);
  fix_box(mesh, {-1, -1, -1}, {0, 1, 1});
  return mesh;
}

// A force down y, shared by the vertices of the end.
VectorXd end_load(const SolidMesh& mesh, const deform::Dofs& dofs, double force) {
  VectorXd load = VectorXd::Zero(dofs.count);
  double count = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (mesh.vertices[v].x < kLength * (1 - 1e-9)) continue;
    load[dofs.first[v] + 1] = 1;
    ++count;
  }
  return -force / count * load;
}

Eigen::Vector3d end_of(const SolidMesh& mesh, const deform::Dofs& dofs, const VectorXd& u) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (mesh.vertices[v].x >= kLength * (1 - 1e-9)) sum += u.segment<3>(dofs.first[v]), ++count;
  return sum / count;
}

// Newton steps under a load that grows in steps.
VectorXd full_balance(const SolidMesh& mesh, const deform::Dofs& dofs, const VectorXd& load) {
  VectorXd u = VectorXd::Zero(dofs.count);
  constexpr int kSteps = 10;
  for (int step = 1; step <= kSteps; ++step) {
    const VectorXd wanted = load * step / kSteps;
    for (int i = 0; i < 30; ++i) {
      const VectorXd rest = wanted - deform::internal_force(mesh, dofs, u);
      if (rest.norm() < 1e-9 * load.norm()) break;
      REQUIRE(i < 29);
      const Eigen::SimplicialLDLT<deform::Sparse> solver(deform::tangent_stiffness(mesh, dofs, u));
      u += solver.solve(rest);
    }
  }
  return u;
}

VectorXd reduced_balance(const ReducedModel& model, const VectorXd& load) {
  const auto r = static_cast<Eigen::Index>(model.modes);
  VectorXd q = VectorXd::Zero(r), force(r);
  MatrixXd slope(r, r);  // symmetric, so the order of its rows and columns does not count
  constexpr int kSteps = 20;
  for (int step = 1; step <= kSteps; ++step)
    for (int i = 0; i < 50; ++i) {
      reduced_force(model, q.data(), force.data());
      const VectorXd rest = load * step / kSteps - force;
      if (rest.norm() < 1e-10 * load.norm()) break;
      REQUIRE(i < 49);
      reduced_stiffness(model, q.data(), slope.data());
      q += slope.ldlt().solve(rest);
    }
  return q;
}

VectorXd project(const ReducedModel& model, const deform::Dofs& dofs, const VectorXd& load) {
  VectorXd out = VectorXd::Zero(static_cast<Eigen::Index>(model.modes));
  for (std::size_t v = 0; v < dofs.first.size(); ++v)
    for (std::size_t j = 0; dofs.first[v] >= 0 && j < model.modes; ++j)
      for (int a = 0; a < 3; ++a)
        out[j] += load[dofs.first[v] + a] * model.basis[(v * model.modes + j) * 3 + a];
  return out;
}

VectorXd unproject(const ReducedModel& model, const deform::Dofs& dofs, const VectorXd& q) {
  VectorXd u = VectorXd::Zero(dofs.count);
  for (std::size_t v = 0; v < dofs.first.size(); ++v)
    for (std::size_t j = 0; dofs.first[v] >= 0 && j < model.modes; ++j)
      for (int a = 0; a < 3; ++a)
        u[dofs.first[v] + a] += q[j] * model.basis[(v * model.modes + j) * 3 + a];
  return u;
}

// A vertex of a warped model.
h6Vec3 warped_vertex(const ReducedModel& model, const VectorXd& q, std::size_t v) {
  h6Vec3 u{}, w{};
  for (std::size_t j = 0; j < model.modes; ++j) {
    const std::size_t at = (v * model.modes + j) * 3;
    const double share = q[static_cast<Eigen::Index>(j)];
    u = u + share * h6Vec3{model.basis[at], model.basis[at + 1], model.basis[at + 2]};
    if (!model.turn.empty())
      w = w + share * h6Vec3{model.turn[at], model.turn[at + 1], model.turn[at + 2]};
  }
  h6Vec3 sum = u, term = u;
  for (int k = 1; k < 30; ++k) term = (1.0 / (k + 1)) * cross(w, term), sum = sum + term;
  return model.mesh.vertices[v] + sum;
}

// Where P1 q = sum (dp/dq)^T F: forces down y at the end, by steps that go half of the way.
VectorXd warped_balance(const ReducedModel& model, double force) {
  const auto r = static_cast<Eigen::Index>(model.modes);
  std::vector<std::size_t> end;
  for (std::size_t v = 0; v < model.mesh.vertices.size(); ++v)
    if (model.mesh.vertices[v].x >= kLength * (1 - 1e-9)) end.push_back(v);
  VectorXd q = VectorXd::Zero(r);
  double change = 1;
  for (int i = 0; i < 400 && change > 1e-9 * q.norm(); ++i) {
    VectorXd next(r);
    for (Eigen::Index j = 0; j < r; ++j) {
      double work = 0;
      for (const double h : {1e-5, -1e-5}) {
        VectorXd moved = q;
        moved[j] += h;
        for (const std::size_t v : end) work += warped_vertex(model, moved, v).y / (2 * h);
      }
      next[j] = -force / double(end.size()) * work / model.linear[std::size_t(j * r + j)];
    }
    change = (next - q).norm();
    q += 0.5 * (next - q);
  }
  CHECK(change < 1e-8 * q.norm());
  return q;
}

// The length of the line through the middle.
template <class F>
double length_of(const SolidMesh& mesh, const F& place) {
  std::vector<std::pair<double, h6Vec3>> line;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (std::fabs(mesh.vertices[v].y - kSide / 2) + std::fabs(mesh.vertices[v].z - kSide / 2) <
        1e-9)
      line.push_back({mesh.vertices[v].x, place(v)});
  double sum = 0;
  for (std::size_t i = 1; i < line.size(); ++i) sum += norm(line[i].second - line[i - 1].second);
  return sum;
}

constexpr double kInertia = kSide * kSide * kSide * kSide / 12;

// Bending and shear, with the shear factor 5/6 of a rectangle.
double timoshenko(const SolidMaterial& m, double force) {
  const double shear = m.young / (2 * (1 + m.poisson)), area = kSide * kSide;
  return force * kLength * kLength * kLength / (3 * m.young * kInertia) +
         force * kLength / (5.0 / 6 * shear * area);
}

}  // namespace

TEST_CASE("a slender steel cantilever of hexahedra bends as Timoshenko's beam") {
  // Fully integrated trilinear hexahedra are too stiff by half the square of an element's length
  // over the beam's height: (1/12)^2 / 2 = 0.35 % here.
  const SolidMesh mesh = cantilever({120, 2, 1}, kSteel);
  const deform::Dofs dofs = deform::free_dofs(mesh);
  const double force = 10;
  const VectorXd load = end_load(mesh, dofs, force);
  const Eigen::SimplicialLDLT<deform::Sparse> solver(
      deform::tangent_stiffness(mesh, dofs, VectorXd::Zero(dofs.count)));
  const double full = -end_of(mesh, dofs, solver.solve(load)).y();
  CHECK(full == doctest::Approx(timoshenko(kSteel, force)).epsilon(0.01));

  const auto model = reduce(mesh, {.modes = 20});
  REQUIRE_MESSAGE(model, model.error());
  const VectorXd q = reduced_balance(*model, project(*model, dofs, load));
  const double tip = -end_of(mesh, dofs, unproject(*model, dofs, q)).y();
  CHECK(tip == doctest::Approx(timoshenko(kSteel, force)).epsilon(0.01));

  // The first frequency of Euler and Bernoulli: 1.8751^2 / (2 pi L^2) sqrt(E I / (rho A)). Shear
  // and rotary inertia lower it by about half a per cent at this slenderness.
  const double first = 1.875104 * 1.875104 / (2 * M_PI * kLength * kLength) *
                       std::sqrt(kSteel.young * kInertia / (kSteel.density * kSide * kSide));
  CHECK(model->frequency[0] == doctest::Approx(first).epsilon(0.01));
}

TEST_CASE("under large loads 20 modes bend a cantilever within 2 % of the full model") {
  const SolidMesh mesh = cantilever({20, 2, 2}, kRubbery);
  const deform::Dofs dofs = deform::free_dofs(mesh);
  const auto model = reduce(mesh, {.modes = 20});
  REQUIRE_MESSAGE(model, model.error());
  const double unit = 3 * kRubbery.young * kInertia / (kLength * kLength);
  for (const double share : {0.25, 0.5, 1.0}) {
    const VectorXd load = end_load(mesh, dofs, share * unit);
    const Eigen::Vector3d full = end_of(mesh, dofs, full_balance(mesh, dofs, load));
    const VectorXd q = reduced_balance(*model, project(*model, dofs, load));
    const Eigen::Vector3d tip = end_of(mesh, dofs, unproject(*model, dofs, q));
    INFO("load ", share, " full ", full.x(), " ", full.y(), " reduced ", tip.x(), " ", tip.y());
    CHECK((tip - full).norm() < 0.02 * full.norm());
    // Linear elasticity says share * L and knows no shortening: this load is far from small.
    if (share == 1) CHECK(full.norm() > 0.3 * kLength);
    if (share == 1) CHECK(full.x() < -0.1 * kLength);
  }
}

TEST_CASE("under large loads warped modes keep a cantilever's end nearer than linear modes") {
  const SolidMesh mesh = cantilever({20, 2, 2}, kRubbery);
  const deform::Dofs dofs = deform::free_dofs(mesh);
  const auto warped = reduce(mesh, {.modes = 20, .warp = true});
  REQUIRE_MESSAGE(warped, warped.error());
  const auto cubic = reduce(mesh, {.modes = 20});
  REQUIRE_MESSAGE(cubic, cubic.error());
  ReducedModel linear = *warped;
  linear.turn.clear();
  const auto whole = [](const Eigen::Vector3d& v) { return h6Vec3{v.x(), v.y(), v.z()}; };
  for (const double share : {0.1, 0.25, 0.5, 1.0}) {
    const double force = share * 3 * kRubbery.young * kInertia / (kLength * kLength);
    const VectorXd load = end_load(mesh, dofs, force), u = full_balance(mesh, dofs, load);
    const h6Vec3 full = whole(end_of(mesh, dofs, u));
    const double length = length_of(mesh, [&](std::size_t v) {
      const std::int32_t at = dofs.first[v];
      return mesh.vertices[v] + (at < 0 ? h6Vec3{} : whole(u.segment<3>(at)));
    });
    const auto compare = [&](const std::string& name, const ReducedModel& model,
                             const VectorXd& q) {
      h6Vec3 sum{};
      double count = 0;
      for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        if (mesh.vertices[v].x >= kLength * (1 - 1e-9))
          sum = sum + warped_vertex(model, q, v) - mesh.vertices[v], ++count;
      const double tip = norm((1 / count) * sum - full) / norm(full);
      const double longer =
          length_of(mesh, [&](std::size_t v) { return warped_vertex(model, q, v); }) / length - 1;
      MESSAGE("load " << share << " end moves " << norm(full) / kLength << " L, " << name
                      << ": end " << 100 * tip << " %, length " << 100 * longer << " %");
      return tip;
    };
    const double of_linear = compare("linear", linear, warped_balance(linear, force));
    const double of_warped = compare("warped", *warped, warped_balance(*warped, force));
    const VectorXd q = reduced_balance(*cubic, project(*cubic, dofs, load));
    compare("cubic", *cubic, q);
    CHECK(of_warped < 0.5 * of_linear);
  }
}
