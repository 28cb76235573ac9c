// SPDX-License-Identifier: Apache-2.0
// scheduler.h - lets the workers of a scheduler of Dask's distributed do the runs.
#pragma once
#include <string>
#include <vector>

#include "io/study/workers.h"

namespace h6::study {

// Fills in which program does the runs: Python, which hands them to the scheduler at `address`.
// `job` is {"study", STUDY, SCENE...}, or the command and arguments of this program that a worker
// runs with --worker.
void use_scheduler(const std::string& address, const std::vector<std::string>& job, Work& work);

}  // namespace h6::study
