// SPDX-License-Identifier: Apache-2.0
// page.h - the pages that io/view/page builds, as they lie in the program; empty where it was built
// without node and npm.
#pragma once
#include <string>
#include <string_view>

namespace h6::io::view {

std::string_view live_page();
std::string_view report_page();  // "@data@" stands where the data goes
// Why there are none: one sentence.
std::string no_page();

}  // namespace h6::io::view
