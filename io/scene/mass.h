// SPDX-License-Identifier: Apache-2.0
// mass.h - computes the mass properties that a scene does not state.
#pragma once
#include <array>
#include <optional>

#include "io/mesh/mesh.h"
#include "io/shell/shell_data.h"

namespace h6::io {

struct MassProperties {
  Vec3 com;                       // mesh frame [m]
  std::array<double, 6> inertia;  // xx yy zz xy xz yz about com, mesh axes [kg m^2]
};

// Treats the mesh as a uniform solid of this mass [kg]. Returns nothing unless the mesh encloses a
// volume: it must be closed and wound consistently, inwards or outwards.
std::optional<MassProperties> solid_mass(const Mesh& mesh, double mass);

// Gives each point an equal share of the mass [kg]. Use it for triangle soups and for shells
// without a mesh.
MassProperties shell_mass(const ShellData& shell, double mass);

}  // namespace h6::io
