// SPDX-License-Identifier: Apache-2.0
// one_part.h - a session of a fixed field (body 0) and a part with a shell (body 1) that a hand may
// hold. Tests set the defs and then open it.
#pragma once
#include <doctest/doctest.h>

#include <array>
#include <utility>

#include "hapsix/hapsix.h"
#include "tests/support/analytic.h"

namespace h6::test {

struct OnePart {
  FieldArrays field;
  ShellArrays shell;
  Model model;
  std::array<h6BodyDef, 2> bodies{h6DefaultBodyDef(), h6DefaultBodyDef()};
  h6HandDef hand = h6DefaultHandDef();
  h6SessionDef def = h6DefaultSessionDef();
  h6Session* session = nullptr;

  OnePart(FieldArrays f, ShellArrays s)
      : field(std::move(f)), shell(std::move(s)), model({def_of(field)}, {shell.def()}) {
    bodies[0].fixed = true, bodies[0].field = 0;
    bodies[1].shell = 0;
    hand.body = 1;
    def.bodies = bodies.data(), def.body_count = 2;
    def.hands = &hand, def.hand_count = 1;
  }
  ~OnePart() { h6DestroySession(session); }
  OnePart(const OnePart&) = delete;
  OnePart& operator=(const OnePart&) = delete;

  // Opens the session, or opens it again.
  void open() {
    h6Error error{};
    h6DestroySession(session);
    session = h6CreateSession(model.handle, &def, &error);
    REQUIRE_MESSAGE(session, error.message);
  }
};

}  // namespace h6::test
