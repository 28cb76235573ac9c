// SPDX-License-Identifier: Apache-2.0
// setting_text.h - settings in words.
#pragma once
#include <string>

#include "runtime/settings/setting.h"

namespace h6::io {

// Ten digits, without trailing zeros.
std::string number_text(double value);
// Empty where the row has no default of its own: it is required, or its sentence names the default.
// Lengths in metres.
std::string default_text(const Setting& row);

}  // namespace h6::io
