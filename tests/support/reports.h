// SPDX-License-Identifier: Apache-2.0
// reports.h - records that the contract writes to the caller's memory, as values.
#pragma once
#include "hapsix/hapsix.h"

namespace h6::test {

inline h6LoopReport joined(h6Loop* loop) {
  h6LoopReport report;
  h6JoinLoop(loop, &report);
  return report;
}
inline h6HandSafety safety_of(const h6Session* session, std::int32_t hand) {
  h6HandSafety safety;
  h6GetSafety(session, hand, &safety);
  return safety;
}

}  // namespace h6::test
