// SPDX-License-Identifier: Apache-2.0
// json.h - is this text JSON that is worth building a tree of?
#pragma once
#include <string>

#include "hapsix/result.h"

namespace h6::io {

// A sentence with line and column when the text is not JSON; with what is too much when it nests
// deeper than 32 or holds over a million values; with the key when an object has it twice (parsers
// would silently take one of them). Memory stays that of the text.
Outcome check_json_text(const std::string& text, const std::string& name);

}  // namespace h6::io
