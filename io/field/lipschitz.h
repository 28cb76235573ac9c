// SPDX-License-Identifier: Apache-2.0
// lipschitz.h - distances differ by at most a voxel from one node to the next: whether samples do.
#pragma once
#include "io/field/field_data.h"

namespace h6::io {

// Samples of neighbours may differ by this much more than a voxel [voxel]: kReachRounding in
// kernels/contact/cull_spheres.h has room for it.
inline constexpr double kSteepSlack = 2e-4;

// The largest difference between the samples of two neighbours, across bricks too [voxel]. A node
// without a brick counts as one that is `beyond` [m] from the surface, or farther.
double steepest_edge(const FieldData& field, double beyond, unsigned threads);

// Lowers samples, as little as it takes, until no neighbours in bricks differ by more than a voxel
// and half of that slack. Of two on one side of the surface the larger is lowered; of two on
// different sides both, in proportion, which leaves the surface between them in place. Samples that
// are no distances at all would take long. It gives up on those, and they stay steep.
void lower_steep_samples(FieldData& field);

}  // namespace h6::io
