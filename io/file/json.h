// SPDX-License-Identifier: Apache-2.0
// json.h - checks a JSON text before a parser builds a tree of it.
#pragma once
#include <string>

#include "hapsix/result.h"

namespace h6::io {

// Fails when the text is not JSON (the sentence gives line and column), nests deeper than 32, holds
// over a million values, or has a key twice in one object (parsers silently take one of the two).
// It needs no more memory than the text.
Outcome check_json_text(const std::string& text, const std::string& name);

}  // namespace h6::io
