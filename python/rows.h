// SPDX-License-Identifier: Apache-2.0
// rows.h - structs of the contract as rows of NumPy's structured arrays, without copies.
#pragma once

namespace hapsix::python {

// Tells pybind11 the rows once, before the first array of them.
void declare_rows();

}  // namespace hapsix::python
