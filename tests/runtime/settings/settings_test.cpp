// SPDX-License-Identifier: Apache-2.0
// settings_test.cpp - rows cover their definitions, give the defaults and refuse what is out of
// range.
#include <cmath>
#include <cstring>

#include "hapsix/hapsix.h"
#include "runtime/settings/engine_settings.h"
#include "tests/runtime/settings/cover.h"

using namespace h6;
using test::every_member_has_a_row;

TEST_CASE("every member of every definition has its row") {
  // No settings: velocity, shell, field. The inertia counts as six members.
  every_member_has_a_row<h6BodyDef>(body_settings(), 3 + 5);
  // One member has no row: pieces, which the row `method` also holds.
  every_member_has_a_row<h6ContactDef>(contact_settings(), 1);
  every_member_has_a_row<h6CouplingDef>(coupling_settings(), 0);
  every_member_has_a_row<h6SafetyDef>(safety_settings(), 0);
  // Two members have no row here: body; coupling, which has its own rows.
  every_member_has_a_row<h6HandDef>(hand_settings(), 2);
  for (const Setting& row : hand_settings())
    if (row.stands_among()) every_member_has_a_row<h6HandFilterDef>(*row.inside, 0);
  // Three arrays with their counts, the contact's definition, the tasks, the allocator,
  // the workers.
  every_member_has_a_row<h6SessionDef>(session_settings(), 10);
  every_member_has_a_row<h6LoopDef>(loop_settings(), 0);
  every_member_has_a_row<h6Pose>(pose_settings(), 0);
}

namespace {

template <class Def>
void check_rows(const SettingTable& rows, const Def& good) {
  h6Error error{};
  CHECK_MESSAGE(check_settings(rows, &good, "", &error), error.message);
  const auto refused = [&](const Setting& row, double value) {
    Def def = good;
    each_setting(rows, &def, [&](const Setting& r, const void* at) {
      if (&r == &row) r.member.set_number(r.member.make(const_cast<void*>(at)), value);
    });
    h6Error said{};
    const bool passed = check_settings(rows, &def, "here: ", &said);
    INFO(std::string(rows.of), ".", std::string(row.name), " = ", value, ": ",
         std::string(said.message));
    CHECK(passed == (said.message[0] == 0));
    if (!passed) {
      CHECK(std::strncmp(said.message, "here: ", 6) == 0);
      CHECK(std::strstr(said.message, row.name) != nullptr);
    }
    return !passed;
  };
  each_setting(rows, &good, [&](const Setting& row, const void* at) {
    if (!row.member.number || row.kind == SettingKind::boolean) return;
    INFO(std::string(rows.of), ".", std::string(row.name));
    CHECK(row.member.number(row.member.get(at)) == row.start);
    CHECK(!refused(row, row.start));
    const Range& r = row.range;
    if (row.kind == SettingKind::number) {
      CHECK(refused(row, NAN));
      CHECK(refused(row, HUGE_VAL));
      CHECK(refused(row, r.low) == r.above_low);
      CHECK(refused(row, r.low - 1e-6));
      if (r.high != kNoLimit) CHECK((!refused(row, r.high) && refused(row, r.high * 1.001)));
    }
    for (const Choice& c : row.choices) CHECK(!refused(row, c.value));
    if (!row.choices.empty()) CHECK((refused(row, -1) && refused(row, 99)));
  });
}

}  // namespace

TEST_CASE("defaults are valid, and what is out of its range is refused with its name") {
  check_rows(body_settings(), h6DefaultBodyDef());
  check_rows(contact_settings(), h6DefaultContactDef());
  check_rows(coupling_settings(), h6DefaultCouplingDef());
  check_rows(safety_settings(), h6DefaultSafetyDef());
  check_rows(hand_settings(), h6DefaultHandDef());
  check_rows(session_settings(), h6DefaultSessionDef());
  check_rows(loop_settings(), h6DefaultLoopDef());
}

TEST_CASE("the sentence has name, range, unit and value") {
  const auto said = [](auto change) {
    h6ContactDef def = h6DefaultContactDef();
    change(def);
    h6Error error{};
    check_settings(contact_settings(), &def, "contact ", &error);
    return std::string(error.message);
  };
  CHECK(said([](h6ContactDef& d) { d.stiffness = -1; }) ==
        "contact stiffness must be in 0..1000000000 N/m, it is -1");
  CHECK(said([](h6ContactDef& d) { d.damping = -1; }) ==
        "contact damping must be in 0..1 s, it is -1");
  CHECK(said([](h6ContactDef& d) { d.epsilon = 3; }) ==
        "contact epsilon must be in (0, 2], it is 3");
  CHECK(said([](h6ContactDef& d) { d.margin_voxels = 3; }) ==
        "contact margin_voxels must be in 0..2 voxel, it is 3");
}

TEST_CASE("a definition is its default until one member changes, also inside") {
  h6HandDef def = h6DefaultHandDef();
  CHECK(is_default(hand_settings(), &def));
  def.filter.clutch_buttons = 1;
  CHECK(!is_default(hand_settings(), &def));
  h6SafetyDef safety = h6DefaultSafetyDef();
  CHECK(is_default(safety_settings(), &safety));
  safety.pose_jump *= 2;
  CHECK(!is_default(safety_settings(), &safety));
}
