// SPDX-License-Identifier: Apache-2.0
// session_checks.h - refuses session definitions that cannot be run.
#pragma once
#include "hapsix/hapsix.h"
#include "runtime/model/model.h"

namespace h6 {

// False with a sentence that names the entry and the range it must be in.
bool check_contact(const h6ContactDef& def, h6Error* error);
bool check_session(const h6Model& model, const h6SessionDef& def, h6Error* error);

}  // namespace h6
