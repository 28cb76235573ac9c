// SPDX-License-Identifier: Apache-2.0
// random_sequences.h - runs random sequences of calls, as many as HAPSIX_SEQUENCES says.
#pragma once
#include <doctest/doctest.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace h6::test {

// Makes Sequence(seed, common) and calls it 40 times, for `usual` seeds unless the environment asks
// for another number. From `enough` seeds on, each of the functions in common.tally must have
// succeeded and failed at least once.
template <class Sequence, class Common>
void run_sequences(Common& common, long usual, long enough, std::size_t functions) {
  const char* const asked = std::getenv("HAPSIX_SEQUENCES");
  const long count = asked ? std::atol(asked) : usual;
  for (long i = 0; i < count; ++i) {
    CAPTURE(i);
    Sequence sequence(static_cast<std::uint64_t>(i), common);
    for (int k = 0; k < 40; ++k) sequence.call();
  }
  MESSAGE(count << " sequences of 40 calls");
  if (count < enough) return;  // too few for functions that are called seldom
  CHECK(common.tally.size() == functions);
  for (const auto& [function, tally] : common.tally) {
    CAPTURE(function);
    CHECK((tally.done > 0 && tally.failed > 0));
  }
}

}  // namespace h6::test
