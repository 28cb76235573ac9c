// SPDX-License-Identifier: Apache-2.0
// session_checks.h - refuses session definitions that cannot be run.
#pragma once
#include "hapsix/hapsix.h"
#include "runtime/model/model.h"

namespace h6 {

// Both return false with a sentence that names the wrong entry and its range.
bool check_contact(const h6ContactDef& def, h6Error* error);
bool check_session(const h6Model& model, const h6SessionDef& def, h6Error* error);

}  // namespace h6
