// SPDX-License-Identifier: Apache-2.0
// near.h - equal up to a relative error, whatever the unit.
#pragma once
#include <doctest/doctest.h>

namespace h6::test {

// doctest::Approx compares on a scale of 1 plus the value: in metres, everything is near
// everything. Here the scale is the value itself; an expected 0 must be met to 1e-12 times epsilon.
inline doctest::Approx near(double value) { return doctest::Approx(value).scale(1e-12); }

}  // namespace h6::test
