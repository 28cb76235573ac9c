// SPDX-License-Identifier: Apache-2.0
// deformable_file.h - reduced models as HDF5, for h5py and MATLAB.
//
//   /config  whole: JSON text (kind, version, modes, free, damping, materials, input_hash,
//            made_with); seal: a hash of all else
//   /mesh    vertices (n, 3) [m]; corners (m, 8), a tetrahedron's last four are 4294967295;
//            material (m), index into the materials; fixed (k)
//   /modes   basis (n, r, 3) [1/sqrt(kg)]; frequency (r) [Hz]; a warped model has turn
//            (n, r, 3) [rad/(m sqrt(kg))], no quadratic and cubic, and version 2
//   /force   linear (r, r), quadratic (r, r(r+1)/2), cubic (r, r(r+1)(r+2)/6), in the order of
//            reduced_model.h
#pragma once
#include <filesystem>

#include "hapsix/result.h"
#include "io/deform/reduced_model.h"

namespace h6::io {

// Writes aside and renames. The model must be consistent.
Outcome write_deformable(const std::filesystem::path& file, const ReducedModel& model);

// A file that is no reduced model, damaged, cut off or changed is refused with a sentence.
Result<ReducedModel> read_deformable(const std::filesystem::path& file);

// Whether an HDF5 file claims to be a reduced model; false where it cannot be read.
bool is_deformable(const std::filesystem::path& file);

}  // namespace h6::io
