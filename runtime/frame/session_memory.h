// SPDX-License-Identifier: Apache-2.0
// session_memory.h - the storage of a session, sized once from its definition.
#pragma once
#include <span>

#include "hapsix/hapsix.h"

namespace h6 {

// Reserves all storage of the session and constructs what lies in it, with the model's shells and
// fields. `listed`: sorted_pairs of the definition. False: `error` says that there is no memory.
bool reserve_memory(h6Session& s, const h6SessionDef& def, std::span<const h6PairDef> listed,
                    h6Error* error);
// Gives it back. What lies in it has no destructors.
void release_memory(h6Session& s);

}  // namespace h6
