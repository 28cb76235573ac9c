// SPDX-License-Identifier: Apache-2.0
#include "io/deform/stvk.h"

namespace h6::io::deform {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

Vector3d vector(const h6Vec3& v) { return {v.x, v.y, v.z}; }

// Places each element's 3 x 3 block for corners a, b in the lower half.
template <class Block>
Sparse assembled(const SolidMesh& mesh, const Dofs& dofs, const Block& blocks) {
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Matrix3d> block(64);  // a * 8 + b
  for (const SolidElement& e : mesh.elements) {
    blocks(e, block);
    for (std::uint32_t a = 0; a < e.corners; ++a)
      for (std::uint32_t b = 0; b < e.corners; ++b) {
        const std::int32_t row = dofs.first[e.corner[a]], column = dofs.first[e.corner[b]];
        if (row < column || column < 0) continue;
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < (row == column ? i + 1 : 3); ++j)
            if (const double value = block[a * 8 + b](i, j); value != 0 || row == column)
              entries.emplace_back(row + i, column + j, value);
      }
  }
  Sparse out(dofs.count, dofs.count);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

}  // namespace

Dofs free_dofs(const SolidMesh& mesh) {
  Dofs dofs;
  dofs.first.assign(mesh.vertices.size(), -1);
  for (const SolidElement& e : mesh.elements)
    for (std::uint32_t a = 0; a < e.corners; ++a) dofs.first[e.corner[a]] = 0;
  for (const std::uint32_t v : mesh.fixed) dofs.first[v] = -1;
  for (std::int32_t& first : dofs.first) {
    if (first < 0) continue;
    first = static_cast<std::int32_t>(dofs.count);
    dofs.count += 3;
  }
  return dofs;
}

Lame lame(const SolidMaterial& m) {
  return {m.young * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson)),
          m.young / (2 * (1 + m.poisson))};
}

Matrix3d green_strain(const Matrix3d& g) { return 0.5 * (g + g.transpose() + g.transpose() * g); }

Matrix3d stress(const Lame& c, const Matrix3d& strain) {
  return c.lambda * strain.trace() * Matrix3d::Identity() + 2 * c.mu * strain;
}

Corners corners_of(const SolidElement& element, const Dofs& dofs,
                   const Eigen::Ref<const VectorXd>& u) {
  Corners out = Corners::Zero();
  for (std::uint32_t a = 0; a < element.corners; ++a)
    if (const std::int32_t first = dofs.first[element.corner[a]]; first >= 0)
      out.row(a) = u.segment<3>(first).transpose();
  return out;
}

Matrix3d gradient_of(const SolidElement& element, const QuadraturePoint& at, const Corners& u) {
  Matrix3d g = Matrix3d::Zero();
  for (std::uint32_t a = 0; a < element.corners; ++a)
    g += u.row(a).transpose() * vector(at.gradient[a]).transpose();
  return g;
}

void add_force(const SolidElement& element, const QuadraturePoint& at, const Matrix3d& p,
               const Dofs& dofs, Eigen::Ref<VectorXd> force) {
  for (std::uint32_t a = 0; a < element.corners; ++a)
    if (const std::int32_t first = dofs.first[element.corner[a]]; first >= 0)
      force.segment<3>(first) += at.weight * (p * vector(at.gradient[a]));
}

Sparse mass_matrix(const SolidMesh& mesh, const Dofs& dofs) {
  return assembled(mesh, dofs, [&](const SolidElement& e, std::vector<Matrix3d>& block) {
    const ShapeProducts products = shape_products(mesh, e);
    const double density = mesh.materials[e.material].density;
    for (std::uint32_t a = 0; a < e.corners; ++a)
      for (std::uint32_t b = 0; b < e.corners; ++b)
        block[a * 8 + b] = density * products[a][b] * Matrix3d::Identity();
  });
}

VectorXd internal_force(const SolidMesh& mesh, const Dofs& dofs, const VectorXd& u) {
  VectorXd force = VectorXd::Zero(dofs.count);
  for (const SolidElement& e : mesh.elements) {
    const Lame c = lame(mesh.materials[e.material]);
    const Corners corners = corners_of(e, dofs, u);
    const Quadrature points = quadrature(mesh, e);
    for (std::size_t i = 0; i < points.count; ++i) {
      const Matrix3d g = gradient_of(e, points.point[i], corners);
      add_force(e, points.point[i], (Matrix3d::Identity() + g) * stress(c, green_strain(g)), dofs,
                force);
    }
  }
  return force;
}

Sparse tangent_stiffness(const SolidMesh& mesh, const Dofs& dofs, const VectorXd& u) {
  return assembled(mesh, dofs, [&](const SolidElement& e, std::vector<Matrix3d>& block) {
    std::fill(block.begin(), block.end(), Matrix3d::Zero());
    const Lame c = lame(mesh.materials[e.material]);
    const Corners corners = corners_of(e, dofs, u);
    const Quadrature points = quadrature(mesh, e);
    for (std::size_t i = 0; i < points.count; ++i) {
      const QuadraturePoint& at = points.point[i];
      const Matrix3d g = gradient_of(e, at, corners), f = Matrix3d::Identity() + g;
      const Matrix3d s = stress(c, green_strain(g)), ff = f * f.transpose();
      for (std::uint32_t a = 0; a < e.corners; ++a)
        for (std::uint32_t b = 0; b < e.corners; ++b) {
          const Vector3d na = vector(at.gradient[a]), nb = vector(at.gradient[b]);
          const Vector3d fa = f * na, fb = f * nb;
          // dP = dF S + F C:sym(F^T dF) with dF = du nb^T, times na.
          block[a * 8 + b] +=
              at.weight * (na.dot(s * nb) * Matrix3d::Identity() + c.lambda * fa * fb.transpose() +
                           c.mu * (fb * fa.transpose() + na.dot(nb) * ff));
        }
    }
  });
}

Eigen::MatrixXd pair_forces(const SolidMesh& mesh, const Dofs& dofs, const Eigen::MatrixXd& modes) {
  const Eigen::Index count = modes.cols();
  Eigen::MatrixXd forces = Eigen::MatrixXd::Zero(dofs.count, count * (count + 1) / 2);
  std::vector<Matrix3d> g(count), linear(count);
  for (const SolidElement& e : mesh.elements) {
    const Lame c = lame(mesh.materials[e.material]);
    const Quadrature points = quadrature(mesh, e);
    std::vector<Corners> corners;
    for (Eigen::Index a = 0; a < count; ++a) corners.push_back(corners_of(e, dofs, modes.col(a)));
    for (std::size_t i = 0; i < points.count; ++i) {
      for (Eigen::Index a = 0; a < count; ++a) {
        g[a] = gradient_of(e, points.point[i], corners[a]);
        linear[a] = stress(c, 0.5 * (g[a] + g[a].transpose()));
      }
      Eigen::Index pair = 0;
      for (Eigen::Index a = 0; a < count; ++a)
        for (Eigen::Index b = a; b < count; ++b) {
          const Matrix3d both = g[a].transpose() * g[b];
          const Matrix3d p =
              stress(c, 0.5 * (both + both.transpose())) + g[a] * linear[b] + g[b] * linear[a];
          add_force(e, points.point[i], p, dofs, forces.col(pair++));
        }
    }
  }
  return forces;
}

}  // namespace h6::io::deform
