// SPDX-License-Identifier: Apache-2.0
#include "io/deform/basis.h"

#include <Spectra/SymGEigsShiftSolver.h>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace h6::io::deform {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Cancelled {};

VectorXd times(const Sparse& symmetric, const Eigen::Ref<const VectorXd>& x) {
  return symmetric.selfadjointView<Eigen::Lower>() * x;
}

// What Spectra asks of (K - shift M)^-1 and of M. Its own take a sparse LU of K, which needs twice
// the time and memory of the factor that is there already.
class Inverse {
 public:
  using Scalar = double;
  Inverse(const Pencil& pencil, Pulse& pulse) : pencil_(pencil), pulse_(pulse) {}
  Index rows() const { return pencil_.mass.rows(); }
  Index cols() const { return rows(); }
  void set_shift(double) {}
  void perform_op(const double* x, double* y) const {
    if (!pulse_.alive()) throw Cancelled{};
    Eigen::Map<VectorXd>(y, rows()) = pencil_.factor.solve(Eigen::Map<const VectorXd>(x, rows()));
  }

 private:
  const Pencil& pencil_;
  Pulse& pulse_;
};

class Mass {
 public:
  using Scalar = double;
  explicit Mass(const Sparse& mass) : mass_(mass) {}
  Index rows() const { return mass_.rows(); }
  Index cols() const { return rows(); }
  void perform_op(const double* x, double* y) const {
    Eigen::Map<VectorXd>(y, rows()) = times(mass_, Eigen::Map<const VectorXd>(x, rows()));
  }

 private:
  const Sparse& mass_;
};

MatrixXd dense(const Sparse& symmetric) {
  const Sparse whole = symmetric.selfadjointView<Eigen::Lower>();
  return MatrixXd(whole);
}

Result<LinearModes> iterate(const Pencil& pencil, Index count, Pulse& pulse) {
  Inverse inverse(pencil, pulse);
  Mass mass(pencil.mass);
  const Index vectors = std::min(pencil.mass.rows(), std::max<Index>(2 * count + 1, count + 20));
  Spectra::SymGEigsShiftSolver<Inverse, Mass, Spectra::GEigsMode::ShiftInvert> solver(
      inverse, mass, count, vectors, pencil.shift);
  try {
    // Not Spectra's own start vector of random numbers: a fixed one that touches every mode.
    VectorXd start(pencil.mass.rows());
    for (Index i = 0; i < start.size(); ++i)
      start[i] = std::fmod(0.61803398874989485 * static_cast<double>(i + 1), 1.0) - 0.5;
    solver.init(start.data());
    solver.compute(Spectra::SortRule::LargestMagn, 1000, 1e-12, Spectra::SortRule::SmallestAlge);
  } catch (const Cancelled&) {
    return Failure{"cancelled"};
  } catch (const std::exception& broken) {
    return Failure{std::string("The modes cannot be computed: ") + broken.what() + "."};
  }
  if (solver.info() != Spectra::CompInfo::Successful)
    return Failure{
        "The modes did not converge; are there elements that are nearly flat, or "
        "materials that differ by many orders of magnitude?"};
  return LinearModes{solver.eigenvalues(), solver.eigenvectors(), {}};
}

// All modes of a small model.
LinearModes all_modes(const Pencil& pencil, Index count) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(dense(pencil.stiffness),
                                                                  dense(pencil.mass));
  return {solver.eigenvalues().head(count), solver.eigenvectors().leftCols(count), {}};
}

// Mass-orthonormal columns q with x = q r, r upper triangular. Gram-Schmidt, twice, which keeps
// small directions that the Gram matrix x^T M x would lose. A dependent column becomes zero.
bool orthonormalize(const Sparse& mass, MatrixXd& x, MatrixXd& r, Pulse& pulse) {
  r = MatrixXd::Zero(x.cols(), x.cols());
  for (Index j = 0; j < x.cols(); ++j) {
    if (!pulse.alive()) return false;
    pulse.share(static_cast<double>(j) / static_cast<double>(x.cols()));
    VectorXd w = x.col(j);
    const double before = std::sqrt(std::max(0.0, w.dot(times(mass, w))));
    for (int pass = 0; pass < 2; ++pass) {
      const VectorXd c = x.leftCols(j).transpose() * times(mass, w);
      w.noalias() -= x.leftCols(j) * c;
      r.col(j).head(j) += c;
    }
    const double length = std::sqrt(std::max(0.0, w.dot(times(mass, w))));
    const bool some = length > 1e-13 * before;
    r(j, j) = some ? length : 0;
    x.col(j) = some ? VectorXd(w / length) : VectorXd::Zero(w.size());
  }
  return true;
}

// Signs are free: the largest component is positive.
void settle_signs(MatrixXd& shape) {
  for (Index j = 0; j < shape.cols(); ++j) {
    Index at = 0;
    shape.col(j).cwiseAbs().maxCoeff(&at);
    if (shape(at, j) < 0) shape.col(j) = -shape.col(j);
  }
}

}  // namespace

Outcome factorize(const SolidMesh& mesh, const Dofs& dofs, bool free, Pencil& pencil) {
  pencil.mass = mass_matrix(mesh, dofs);
  pencil.stiffness = tangent_stiffness(mesh, dofs, VectorXd::Zero(dofs.count));
  // About the order of the lowest frequency of a chain of n elements, seen from its highest one.
  if (free) {
    const VectorXd ratio = pencil.stiffness.diagonal().cwiseQuotient(pencil.mass.diagonal());
    const double n = static_cast<double>(dofs.count);
    pencil.shift = -ratio.mean() / (n * n);
  }
  pencil.factor.compute(pencil.stiffness - pencil.shift * pencil.mass);
  const VectorXd pivots =
      pencil.factor.info() == Eigen::Success ? VectorXd(pencil.factor.vectorD()) : VectorXd();
  const double most = pivots.size() ? pivots.maxCoeff() : 0;
  if (!(most > 0) || !(pivots.minCoeff() > 1e-14 * most))
    return Failure{
        "The model can bend without any force: some of its elements hang on the others "
        "by a corner or an edge only, or are nearly flat."};
  return Done{};
}

Result<LinearModes> linear_modes(const Pencil& pencil, Index count, bool free, Pulse& pulse) {
  const Index rigid = free ? 6 : 0, wanted = count + rigid, n = pencil.mass.rows();
  if (wanted > n)
    return Failure{"The model has only " + std::to_string(n - rigid) +
                   " degrees of freedom; ask for fewer modes."};
  LinearModes modes;
  if (n <= 100 || wanted > n / 3) {
    modes = all_modes(pencil, wanted);
  } else {
    Result<LinearModes> found = iterate(pencil, wanted, pulse);
    if (!found) return found;
    modes = std::move(*found);
  }
  modes.rigid = modes.shape.leftCols(rigid);
  modes.eigenvalue = modes.eigenvalue.tail(count).eval();
  modes.shape = modes.shape.rightCols(count).eval();
  if (!(modes.eigenvalue[0] > 0) || !modes.shape.allFinite())
    return Failure{
        "The model can bend without any force: some of its elements hang on the others "
        "by a corner or an edge only."};
  settle_signs(modes.shape);
  return modes;
}

MatrixXd modal_derivatives(const SolidMesh& mesh, const Dofs& dofs, const Pencil& pencil,
                           const LinearModes& modes, Pulse& pulse) {
  MatrixXd derivatives = pair_forces(mesh, dofs, modes.shape);
  const MatrixXd& rigid = modes.rigid;
  const MatrixXd momentum = pencil.mass.selfadjointView<Eigen::Lower>() * rigid;
  derivatives -= momentum * (rigid.transpose() * derivatives);
  for (Index j = 0; j < derivatives.cols() && pulse.alive(); ++j) {
    pulse.share(static_cast<double>(j) / static_cast<double>(derivatives.cols()));
    const VectorXd force = -derivatives.col(j);  // solve() must not read what it writes
    derivatives.col(j) = pencil.factor.solve(force);
  }
  derivatives -= rigid * (momentum.transpose() * derivatives);
  return derivatives;
}

Result<Basis> principal_basis(const Pencil& pencil, const LinearModes& modes,
                              const MatrixXd& derivatives, double amplitude, Index directions,
                              Pulse& pulse) {
  const Index k = modes.shape.cols();
  MatrixXd x(modes.shape.rows(), k + derivatives.cols()), r;
  // A load that deflects mode 1 by the amplitude deflects mode i by q_i, and the shape then bends
  // by the derivatives times q_i q_j.
  const VectorXd q = amplitude * modes.eigenvalue[0] * modes.eigenvalue.cwiseInverse();
  x.leftCols(k) = modes.shape * q.asDiagonal();
  for (Index i = 0, pair = 0; i < k; ++i)
    for (Index j = i; j < k; ++j, ++pair)
      x.col(k + pair) = (i == j ? 0.5 : 1) * q[i] * q[j] * derivatives.col(pair);
  if (!orthonormalize(pencil.mass, x, r, pulse)) return Failure{"cancelled"};
  const Eigen::JacobiSVD<MatrixXd> svd(r, Eigen::ComputeThinU);
  const VectorXd& s = svd.singularValues();
  const Index rank = (s.array() > 1e-12 * s[0]).count();
  if (rank < directions)
    return Failure{"The linear modes and their derivatives span " + std::to_string(rank) +
                   " directions; ask for at most as many modes, or for more linear modes."};
  MatrixXd shape = x * svd.matrixU().leftCols(directions);
  orthonormalize(pencil.mass, shape, r, pulse);
  const MatrixXd reduced =
      shape.transpose() * (pencil.stiffness.selfadjointView<Eigen::Lower>() * shape);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> turn(0.5 * (reduced + reduced.transpose()));
  shape = (shape * turn.eigenvectors()).eval();
  settle_signs(shape);
  return Basis{std::move(shape), turn.eigenvalues(),
               s.head(directions).squaredNorm() / s.squaredNorm()};
}

}  // namespace h6::io::deform
