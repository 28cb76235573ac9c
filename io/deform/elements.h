// SPDX-License-Identifier: Apache-2.0
// elements.h - shape functions of linear tetrahedra and trilinear hexahedra. Private.
#pragma once
#include <array>
#include <cstddef>

#include "io/deform/solid_mesh.h"

namespace h6::io::deform {

// A point of quadrature: what it weighs, and each corner's shape function and its gradient.
struct QuadraturePoint {
  double weight = 0;                 // share of the volume [m^3]; <= 0: the element is inverted
  std::array<double, 8> value{};     // N_a
  std::array<h6Vec3, 8> gradient{};  // dN_a/dX [1/m]
};

// One point for a tetrahedron, whose gradients are constant; the 2 x 2 x 2 points of Gauss for a
// hexahedron, x fastest. Exact for the mass of parallelepipeds and enough against hourglass modes.
struct Quadrature {
  std::array<QuadraturePoint, 8> point;
  std::size_t count = 0;
};
Quadrature quadrature(const SolidMesh& mesh, const SolidElement& element);

// The same at local coordinates in [0, 1] (a tetrahedron's are the weights of corners 1, 2, 3),
// with weight = the determinant dX/d(local).
QuadraturePoint at_local(const SolidMesh& mesh, const SolidElement& element, const h6Vec3& local);

// The integral of N_a N_b over an element is this times the density [m^3], a and b its corners.
using ShapeProducts = std::array<std::array<double, 8>, 8>;
ShapeProducts shape_products(const SolidMesh& mesh, const SolidElement& element);

}  // namespace h6::io::deform
