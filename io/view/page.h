// SPDX-License-Identifier: Apache-2.0
// page.h - the HTML pages built from io/view/page, inside the program; empty when it was built
// without node and npm.
#pragma once
#include <string>
#include <string_view>

namespace h6::io::view {

std::string_view live_page();
std::string_view pick_page();
std::string_view report_page();  // "@data@" marks the place of the data
// One sentence that tells why there are none.
std::string no_page();

}  // namespace h6::io::view
