// SPDX-License-Identifier: Apache-2.0
// doctest.cpp - doctest's own code, compiled once: in each test it cost more than the test.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
