// SPDX-License-Identifier: Apache-2.0
// parquet.h - a table of CSV as Parquet, by pyarrow, where a Python has it. No library of Debian 12
// writes Parquet.
#pragma once
#include <filesystem>

#include "hapsix/result.h"

namespace h6::study {

// Writes `parquet` whole or not at all. False: no python3 here has pyarrow.
Result<bool> write_parquet(const std::filesystem::path& csv, const std::filesystem::path& parquet);

}  // namespace h6::study
