// SPDX-License-Identifier: Apache-2.0
// report_files.h - recordings in, one HTML file out.
#pragma once
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/console/console.h"

namespace h6::cli {

// Its size in bytes. What the report has to do without, a recording's contacts for instance, is
// said on stderr and in the report.
Result<std::size_t> write_report(const std::vector<std::string>& recordings,
                                 const std::string& output, const Console& console);

}  // namespace h6::cli
