// SPDX-License-Identifier: Apache-2.0
// report_files.h - makes one HTML file from recordings.
#pragma once
#include <string>
#include <vector>

#include "hapsix/result.h"
#include "io/console/console.h"

namespace h6::cli {

// Returns its size in bytes. Messages on stderr and in the report name what is missing, for
// instance a recording's contacts.
Result<std::size_t> write_report(const std::vector<std::string>& recordings,
                                 const std::string& output, const Console& console);

}  // namespace h6::cli
