// SPDX-License-Identifier: Apache-2.0
// inner_faces.h - faces between solids that abut.
#pragma once
#include "io/mesh/mesh.h"

namespace h6::io {

// The mesh without pairs of triangles that have the same corners and opposite windings, where these
// pairs lie between two solids: their region has no border of its own, and other faces continue at
// its border. A sheet that is drawn twice, once for each side, stays. Vertices stay too; parts are
// not kept. Indices must be in range, vertices welded.
Mesh without_inner_faces(const Mesh& mesh);

}  // namespace h6::io
