// SPDX-License-Identifier: Apache-2.0
// single_precision.h - whether a mesh lies too far from its origin for numbers of 24 bits.
#pragma once
#include <string>

#include "io/mesh/mesh.h"

namespace h6::io {

// Empty, or what to tell: around the box low..high [m] single-precision numbers - the coordinates
// of an STL, the points of a shell - are further apart than a 20th of a voxel at 256 voxels. Fields
// are not concerned: their origin is double, their samples are small.
std::string too_far_for_floats(const Vec3& low, const Vec3& high);
std::string too_far_for_floats(const Mesh& mesh);

}  // namespace h6::io
