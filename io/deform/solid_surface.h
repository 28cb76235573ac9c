// SPDX-License-Identifier: Apache-2.0
// solid_surface.h - the outer faces of a solid mesh as triangles.
#pragma once
#include <cstdint>
#include <vector>

#include "io/deform/solid_mesh.h"

namespace h6::io {

// Three vertices for each triangle, anticlockwise as seen from outside. A face belongs to the
// surface where one element has it; quadrilaterals become two triangles.
std::vector<std::uint32_t> surface_of(const SolidMesh& mesh);

}  // namespace h6::io
