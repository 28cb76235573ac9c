// SPDX-License-Identifier: Apache-2.0
// one_part.h - a part on a field for tests, which set the defs and then open the session.
#pragma once
#include <doctest/doctest.h>

#include "tests/support/part_on_field.h"

namespace h6::test {

struct OnePart : PartOnField {
  using PartOnField::PartOnField;

  // Opens the session, or opens it again.
  void open() {
    h6Error error{};
    h6DestroySession(session);
    session = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
};

}  // namespace h6::test
