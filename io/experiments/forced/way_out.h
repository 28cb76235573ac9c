// SPDX-License-Identifier: Apache-2.0
// way_out.h - whether the half-spaces of a body's contacts have a common interior: a motion that
// ends all of them at once. Where they have none, such as between walls that are nearer to each
// other than the body is thick, no rule that shares stiffness can end the overlap.
#pragma once
#include <optional>

#include "hapsix/hapsix.h"

namespace h6::cli {

// The least length |q| of a small motion q with J_i.q >= depth_i for every contact that touches,
// J = [N; (r x N)/L], N the direction of the push; turns count at the lever L > 0 [m]. None when
// there is no such motion, or only one of more than kFarthestOut depths.
inline constexpr double kFarthestOut = 50;
std::optional<double> way_out(const h6Contacts& contacts, double lever);

}  // namespace h6::cli
