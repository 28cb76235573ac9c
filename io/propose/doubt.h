// SPDX-License-Identifier: Apache-2.0
// doubt.h - advice on a proposed scene whose trial did not go well.
#pragma once
#include "io/scene/verdict.h"

namespace h6::io {

// A sentence of advice; null where the part touched and held, or where no hand held it.
const char* doubt_of(Verdict verdict);

}  // namespace h6::io
