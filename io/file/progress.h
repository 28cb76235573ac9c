// SPDX-License-Identifier: Apache-2.0
// progress.h - how long work reports its progress and learns that it was cancelled.
#pragma once
#include <functional>
#include <string>

namespace h6::io {

// The work calls this now and then, from the thread that started it, with done in [0, 1]. Return
// false to cancel: the work ends soon, leaves no half-made result and fails with the sentence
// "cancelled".
using Progress = std::function<bool(const std::string& what, double done)>;

}  // namespace h6::io
