// SPDX-License-Identifier: Apache-2.0
// The reduction against the full finite element model: modes, force, stiffness.
#include "io/deform/reduce.h"

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <cmath>

#include "io/deform/basis.h"
#include "io/deform/stvk.h"
#include "tests/io/deform/solids.h"

using namespace h6;
using namespace h6::io;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A shaken bar of two materials, fixed at x = 0.
SolidMesh bar(bool tets) {
  SolidMesh mesh = solids::shaken(solids::block({0.5, 0.1, 0.08}, {8, 3, 2}), 0.006);
  if (tets) mesh = solids::tetrahedra(mesh);
  mesh.materials.push_back({"foam", 2e6, 0.1, 300});
  for (std::size_t e = mesh.elements.size() / 2; e < mesh.elements.size(); ++e)
    mesh.elements[e].material = 1;
  fix_box(mesh, {-1, -1, -1}, {0.01, 1, 1});
  return mesh;
}

ReducedModel reduced(const SolidMesh& mesh, const ReduceOptions& options) {
  const Result<ReducedModel> model = reduce(mesh, options);
  REQUIRE_MESSAGE(model, model.error());
  REQUIRE(consistent(*model));
  return *model;
}

MatrixXd basis_of(const ReducedModel& model, const deform::Dofs& dofs) {
  MatrixXd basis(dofs.count, static_cast<Eigen::Index>(model.modes));
  for (std::size_t v = 0; v < dofs.first.size(); ++v)
    for (std::size_t j = 0; j < model.modes; ++j)
      for (int a = 0; a < 3; ++a) {
        const double value = model.basis[(v * model.modes + j) * 3 + a];
        if (dofs.first[v] >= 0)
          basis(dofs.first[v] + a, static_cast<Eigen::Index>(j)) = value;
        else
          REQUIRE(value == 0);
      }
  return basis;
}

MatrixXd whole(const deform::Sparse& lower) {
  const deform::Sparse both = lower.selfadjointView<Eigen::Lower>();
  return MatrixXd(both);
}

// Deflections as large as the part.
VectorXd some_q(const ReducedModel& model, std::uint64_t seed) {
  VectorXd q(static_cast<Eigen::Index>(model.modes));
  for (Eigen::Index j = 0; j < q.size(); ++j)
    q[j] = 0.2 * solids::noise(seed, j) * model.frequency[0] / model.frequency[j];
  return q;
}

}  // namespace

TEST_CASE("the full force is the energy's gradient and the stiffness the force's") {
  for (const bool tets : {false, true}) {
    const SolidMesh mesh = bar(tets);
    const deform::Dofs dofs = deform::free_dofs(mesh);
    VectorXd u(dofs.count), d(dofs.count);
    for (Eigen::Index i = 0; i < dofs.count; ++i)
      u[i] = 0.01 * solids::noise(1, i), d[i] = solids::noise(2, i);
    const double h = 1e-6;
    const VectorXd slope = (deform::internal_force(mesh, dofs, u + h * d) -
                            deform::internal_force(mesh, dofs, u - h * d)) /
                           (2 * h);
    const VectorXd by_matrix = whole(deform::tangent_stiffness(mesh, dofs, u)) * d;
    CHECK((slope - by_matrix).norm() < 1e-6 * by_matrix.norm());

    const auto energy = [&](const VectorXd& at) {
      double sum = 0;
      for (const SolidElement& e : mesh.elements) {
        const deform::Lame c = deform::lame(mesh.materials[e.material]);
        const deform::Quadrature points = deform::quadrature(mesh, e);
        for (std::size_t i = 0; i < points.count; ++i) {
          const Eigen::Matrix3d strain = deform::green_strain(
              deform::gradient_of(e, points.point[i], deform::corners_of(e, dofs, at)));
          sum += points.point[i].weight *
                 (0.5 * c.lambda * strain.trace() * strain.trace() + c.mu * strain.squaredNorm());
        }
      }
      return sum;
    };
    const double power = deform::internal_force(mesh, dofs, u).dot(d);
    CHECK((energy(u + h * d) - energy(u - h * d)) / (2 * h) ==
          doctest::Approx(power).epsilon(1e-6));
  }
}

TEST_CASE("rigid motion, however far, makes no force, and mass adds up") {
  for (const bool tets : {false, true}) {
    SolidMesh mesh = bar(tets);
    mesh.fixed.clear();
    const deform::Dofs dofs = deform::free_dofs(mesh);
    const h6Quat turn = turn_by({0.3, -1.2, 0.8});
    VectorXd u(dofs.count), along = VectorXd::Zero(dofs.count);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const h6Vec3 moved = rotate(turn, mesh.vertices[v]) + h6Vec3{0.1, 2, -0.4} - mesh.vertices[v];
      u.segment<3>(dofs.first[v]) << moved.x, moved.y, moved.z;
      along[dofs.first[v]] = 1;
    }
    const double stiff = whole(deform::tangent_stiffness(mesh, dofs, u)).cwiseAbs().maxCoeff();
    CHECK(deform::internal_force(mesh, dofs, u).cwiseAbs().maxCoeff() < 1e-12 * stiff);
    const double mass = check_solid(mesh, true)->mass;
    CHECK(along.dot(whole(deform::mass_matrix(mesh, dofs)) * along) ==
          doctest::Approx(mass).epsilon(1e-12));
  }
}

TEST_CASE("linear modes equal those of a dense eigen-solve, fixed and free") {
  for (const bool free : {false, true}) {
    SolidMesh mesh = bar(free);
    if (free) mesh.fixed.clear();
    const deform::Dofs dofs = deform::free_dofs(mesh);
    deform::Pencil pencil;
    REQUIRE(deform::factorize(mesh, dofs, free, pencil));
    const Progress none;
    Pulse pulse(none);
    const auto found = deform::linear_modes(pencil, 12, free, pulse);
    REQUIRE_MESSAGE(found, found.error());
    const MatrixXd m = whole(pencil.mass), k = whole(pencil.stiffness);
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> dense(k, m);
    const VectorXd expected = dense.eigenvalues().segment(free ? 6 : 0, 12);
    REQUIRE(dofs.count > 200);
    const MatrixXd cross =
        dense.eigenvectors().middleCols(free ? 6 : 0, 12).transpose() * m * found->shape;
    for (int j = 0; j < 12; ++j) {
      CHECK(found->eigenvalue[j] == doctest::Approx(expected[j]).epsilon(1e-8));
      CHECK(std::abs(cross(j, j)) == doctest::Approx(1).epsilon(1e-7));
    }
    CHECK((found->shape.transpose() * m * found->shape - MatrixXd::Identity(12, 12)).norm() < 1e-9);
    CHECK(found->rigid.cols() == (free ? 6 : 0));
  }
}

TEST_CASE("a modal derivative is how the static answer curves") {
  const SolidMesh mesh = bar(false);
  const deform::Dofs dofs = deform::free_dofs(mesh);
  deform::Pencil pencil;
  REQUIRE(deform::factorize(mesh, dofs, false, pencil));
  const Progress none;
  Pulse pulse(none);
  const auto modes = deform::linear_modes(pencil, 3, false, pulse);
  REQUIRE(modes);
  const MatrixXd derivatives = deform::modal_derivatives(mesh, dofs, pencil, *modes, pulse);
  REQUIRE(derivatives.cols() == 6);
  // f(q_0 m_0 + q_2 m_2 + 1/2 sum q q derivative) has no second order, so halving q cuts what is
  // left to an eighth.
  const auto rest = [&](double s) {
    const double q0 = s, q2 = -0.5 * s;
    const VectorXd linear = q0 * modes->shape.col(0) + q2 * modes->shape.col(2);
    const VectorXd u = linear + 0.5 * q0 * q0 * derivatives.col(0) + q0 * q2 * derivatives.col(2) +
                       0.5 * q2 * q2 * derivatives.col(5);
    return (deform::internal_force(mesh, dofs, u) -
            pencil.stiffness.selfadjointView<Eigen::Lower>() * linear)
        .norm();
  };
  const double ratio = rest(1e-3) / rest(5e-4);
  CHECK(ratio > 7.5);
  CHECK(ratio < 8.5);
}

TEST_CASE("the reduced force and stiffness are the full ones, projected, at any q") {
  for (const bool tets : {false, true})
    for (const int modes : {1, 7, 20}) {
      const SolidMesh mesh = bar(tets);
      const ReducedModel model = reduced(mesh, {.modes = modes, .linear_modes = 8});
      const deform::Dofs dofs = deform::free_dofs(mesh);
      const MatrixXd basis = basis_of(model, dofs);
      const MatrixXd one = basis.transpose() * whole(deform::mass_matrix(mesh, dofs)) * basis;
      CHECK((one - MatrixXd::Identity(modes, modes)).norm() < 1e-11);
      for (std::uint64_t seed = 0; seed < 5; ++seed) {
        const VectorXd q = some_q(model, seed), u = basis * q;
        const VectorXd full = basis.transpose() * deform::internal_force(mesh, dofs, u);
        const MatrixXd full_slope =
            basis.transpose() * whole(deform::tangent_stiffness(mesh, dofs, u)) * basis;
        VectorXd force(modes);
        Eigen::Matrix<double, -1, -1, Eigen::RowMajor> slope(modes, modes);
        reduced_force(model, q.data(), force.data());
        reduced_stiffness(model, q.data(), slope.data());
        CHECK((force - full).norm() < 1e-10 * full.norm());
        CHECK((slope - full_slope).norm() < 1e-10 * full_slope.norm());
        // The higher orders count here.
        const VectorXd linear =
            basis.transpose() *
            whole(deform::tangent_stiffness(mesh, dofs, VectorXd::Zero(dofs.count))) * u;
        CHECK((linear - full).norm() > 0.01 * full.norm());
      }
    }
}

TEST_CASE("the linear term is diagonal and gives the frequencies, and the lowest one is exact") {
  const SolidMesh mesh = bar(false);
  const ReducedModel model = reduced(mesh, {.modes = 15});
  const deform::Dofs dofs = deform::free_dofs(mesh);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> dense(
      whole(deform::tangent_stiffness(mesh, dofs, VectorXd::Zero(dofs.count))),
      whole(deform::mass_matrix(mesh, dofs)));
  const double lowest = std::sqrt(dense.eigenvalues()[0]) / (2 * M_PI);
  CHECK(model.frequency[0] == doctest::Approx(lowest).epsilon(1e-4));
  for (std::size_t i = 0; i < 15; ++i) {
    if (i > 0) CHECK(model.frequency[i] >= model.frequency[i - 1]);
    const double w = 2 * M_PI * model.frequency[i];
    for (std::size_t j = 0; j < 15; ++j)
      CHECK(model.linear[i * 15 + j] ==
            doctest::Approx(i == j ? w * w : 0).epsilon(1e-9).scale(model.linear[14 * 15 + 14]));
  }
  // 5 % of the critical damping at the lowest frequency.
  const double w = 2 * M_PI * model.frequency[0];
  CHECK(model.mass_damping / (2 * w) + model.stiffness_damping * w / 2 == doctest::Approx(0.05));
}

TEST_CASE("a free model's modes carry no momentum") {
  SolidMesh mesh = bar(true);
  mesh.fixed.clear();
  const ReducedModel model = reduced(mesh, {.modes = 12, .free = true});
  const deform::Dofs dofs = deform::free_dofs(mesh);
  const MatrixXd momentum = whole(deform::mass_matrix(mesh, dofs)) * basis_of(model, dofs);
  for (Eigen::Index j = 0; j < 12; ++j) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), l = p;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Eigen::Vector3d part = momentum.col(j).segment<3>(dofs.first[v]);
      const h6Vec3& x = mesh.vertices[v];
      p += part, l += Eigen::Vector3d(x.x, x.y, x.z).cross(part);
    }
    CHECK(p.norm() < 1e-6 * momentum.col(j).lpNorm<1>());
    CHECK(l.norm() < 1e-6 * momentum.col(j).lpNorm<1>());
  }
  CHECK(model.frequency[0] > 1);
}

TEST_CASE("the same bits for any number of threads") {
  const SolidMesh mesh = bar(false);
  const ReducedModel one = reduced(mesh, {.modes = 20, .threads = 1});
  const ReducedModel three = reduced(mesh, {.modes = 20, .threads = 3});
  CHECK(one.basis == three.basis);
  CHECK(one.quadratic == three.quadratic);
  CHECK(one.cubic == three.cubic);
}

TEST_CASE("a reduction can be cancelled at any time, and options out of range are refused") {
  const SolidMesh mesh = bar(false);
  for (int last = 0; last < 6; ++last) {
    int calls = 0;
    const auto stopped =
        reduce(mesh, {}, nullptr, [&](const std::string&, double) { return calls++ < last; });
    if (!stopped) CHECK(stopped.error() == "cancelled");
    if (last < 4) CHECK_FALSE(stopped);
  }
  for (const ReduceOptions& wrong :
       {ReduceOptions{.modes = 0}, ReduceOptions{.modes = 61}, ReduceOptions{.linear_modes = -1},
        ReduceOptions{.damping = NAN}, ReduceOptions{.modes = 60, .linear_modes = 2}}) {
    const auto refused = reduce(mesh, wrong);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().ends_with("."));
  }
}
