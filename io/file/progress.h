// SPDX-License-Identifier: Apache-2.0
// progress.h - how long work tells somebody that it goes on, and hears that it should stop.
#pragma once
#include <functional>
#include <string>

namespace h6::io {

// Called from the thread that started the work, now and then, with done in [0, 1]. Return false to
// cancel: the work ends soon, leaves nothing half made and fails with the sentence "cancelled".
using Progress = std::function<bool(const std::string& what, double done)>;

}  // namespace h6::io
