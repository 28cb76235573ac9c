// SPDX-License-Identifier: Apache-2.0
// reduce.h - from a solid mesh to a reduced model.
#pragma once
#include "hapsix/result.h"
#include "io/deform/reduced_model.h"
#include "io/file/progress.h"

namespace h6::io {

struct ReduceOptions {
  int modes = 20;        // r, 1 .. kMostModes
  int linear_modes = 0;  // that the basis is made of, 1 .. 60; 0: as many as r, at most 20
  // Linear modes alone, whose displacements are warped by turns (Choi & Ko 2005), and a linear
  // force.
  bool warp = false;
  bool free = false;  // nothing is fixed: rigid modes are left out
  // Share of the critical damping of the lowest mode, 0 .. 1; higher modes get more. Half comes
  // from the mass, half from the stiffness.
  double damping = 0.05;
  unsigned threads = 0;  // 0: all
};

// 32 hex digits of the mesh, its materials and fixed vertices, and the options; `threads` does not
// count. `input_hash` of the model.
std::string reduction_key(const SolidMesh& mesh, const ReduceOptions& options);

struct ReduceReport {
  SolidFacts facts;
  std::size_t freedoms = 0;  // degrees of freedom of the full model
  double captured = 0;       // share of the scaled modes' and derivatives' mass norm in the basis
  struct Stage {
    std::string name;
    double seconds;
  };
  std::vector<Stage> stages;
};

// Linear modes by shift and invert, their modal derivatives, both scaled by frequency, the r
// principal directions of all in the mass norm, and the exact polynomials of the internal force,
// contracted element by element (Barbic & James 2005, Sec. 3 and 4). The basis is turned so that
// P1 is diagonal. With `warp`: the r linear modes of lowest frequency. The result does not depend
// on the number of threads.
Result<ReducedModel> reduce(const SolidMesh& mesh, const ReduceOptions& options,
                            ReduceReport* report = nullptr, const Progress& progress = {});

}  // namespace h6::io
