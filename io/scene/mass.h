// SPDX-License-Identifier: Apache-2.0
// mass.h - mass properties of parts whose scene does not state them.
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

// As a uniform solid of this mass [kg]. Only for a mesh that encloses a volume: closed, and wound
// consistently, inwards or outwards.
std::optional<MassProperties> solid_mass(const Mesh& mesh, double mass);

// Each point has an equal share of the mass. For soups, and for shells without a mesh.
MassProperties shell_mass(const ShellData& shell, double mass);

}  // namespace h6::io
