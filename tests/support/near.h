// SPDX-License-Identifier: Apache-2.0
// near.h - compares numbers up to a relative error, in any unit.
#pragma once
#include <doctest/doctest.h>

namespace h6::test {

// doctest::Approx allows an error of epsilon times (1 + value). For small lengths in metres that is
// far too much. Here the error is relative to the value; an expected 0 allows 1e-12 times epsilon.
inline doctest::Approx near(double value) { return doctest::Approx(value).scale(1e-12); }

}  // namespace h6::test
