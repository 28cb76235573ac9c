// SPDX-License-Identifier: Apache-2.0
// part_on_field.h - a fixed field (body 0) and a part with a shell (body 1) that a hand may hold,
// for tests and benches.
#pragma once
#include <array>
#include <utility>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"

namespace h6::test {

struct PartOnField {
  FieldArrays field;
  ShellArrays shell;
  Model model;
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  h6Session* session = nullptr;

  PartOnField(FieldArrays f, ShellArrays s)
      : field(std::move(f)), shell(std::move(s)), model({def_of(field)}, {shell.def()}) {
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    hand.body = 1;
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
  }
  ~PartOnField() { h6DestroySession(session); }
  PartOnField(const PartOnField&) = delete;
  PartOnField& operator=(const PartOnField&) = delete;
};

}  // namespace h6::test
