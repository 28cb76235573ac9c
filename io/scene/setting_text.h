// SPDX-License-Identifier: Apache-2.0
// setting_text.h - writes numbers and defaults of settings as text.
#pragma once
#include <string>

#include "runtime/settings/setting.h"

namespace h6::io {

// Ten digits, without trailing zeros.
std::string number_text(double value);
// The default of a row, with lengths in metres. It is empty if the row is required or if its
// description names the default.
std::string default_text(const Setting& row);

}  // namespace h6::io
