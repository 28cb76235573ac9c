// SPDX-License-Identifier: Apache-2.0
// spacemouse_report_test.cpp - reports of a SpaceMouse: both layouts, buttons, battery, random
// bytes.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <utility>

#include "device/hid_port.h"
#include "device/spacemouse_report.h"
#include "tests/device/spacemouse_samples.h"

using namespace h6::device;
using h6::test::Bytes;
using h6::test::int16s;
using h6::test::operator+;

namespace {
using Axes = std::array<std::int16_t, 6>;
const ReportLayout layouts[] = {ReportLayout::unknown, ReportLayout::split, ReportLayout::joint};
}  // namespace

TEST_CASE("a cap with two reports: translation and turn come one by one and keep each other") {
  SpaceMouseState s;
  // In a SpaceNavigator's order: at rest, a turn about y of -30, translation, button 1, both
  // buttons, no button.
  CHECK(take_report(Bytes{1, 0, 0, 0, 0, 0, 0}, ReportLayout::split, s) == ReportKind::motion);
  CHECK(take_report(Bytes{2, 0, 0, 0xe2, 0xff, 0, 0}, ReportLayout::split, s) ==
        ReportKind::motion);
  CHECK(s.axis == Axes{0, 0, 0, 0, -30, 0});
  CHECK(take_report(Bytes{1} + int16s({-7, 129, 10}), ReportLayout::split, s) ==
        ReportKind::motion);
  CHECK(s.axis == Axes{-7, 129, 10, 0, -30, 0});
  for (const auto& [report, buttons] :
       {std::pair<Bytes, unsigned>{{3, 1, 0}, 1}, {{3, 3, 0}, 3}, {{3, 2, 0}, 2}, {{3, 0, 0}, 0}}) {
    CHECK(take_report(report, ReportLayout::split, s) == ReportKind::buttons);
    CHECK(s.buttons == buttons);
  }
  CHECK(s.axis == Axes{-7, 129, 10, 0, -30, 0});
}

TEST_CASE("a cap with one report: all six axes at once, with or without a descriptor") {
  for (const ReportLayout layout : {ReportLayout::joint, ReportLayout::unknown}) {
    SpaceMouseState s;
    const Bytes report = Bytes{1} + int16s({1, -2, 3, -4, 5, -350});
    REQUIRE(report.size() == 13);
    CHECK(take_report(report, layout, s) == ReportKind::motion);
    CHECK(s.axis == Axes{1, -2, 3, -4, 5, -350});
  }
}

TEST_CASE("without a descriptor the length of report 1 tells the layout") {
  SpaceMouseState s;
  CHECK(take_report(Bytes{1} + int16s({10, 20, 30}), ReportLayout::unknown, s) ==
        ReportKind::motion);
  CHECK(take_report(Bytes{2} + int16s({40, 50, 60}), ReportLayout::unknown, s) ==
        ReportKind::motion);
  CHECK(s.axis == Axes{10, 20, 30, 40, 50, 60});
}

TEST_CASE("the descriptor tells the layout, and a damaged one tells nothing") {
  const Bytes split = h6::test::spacemouse_descriptor(false),
              joint = h6::test::spacemouse_descriptor(true);
  CHECK(layout_of_descriptor(split) == ReportLayout::split);
  CHECK(layout_of_descriptor(joint) == ReportLayout::joint);
  CHECK(layout_of_descriptor({}) == ReportLayout::unknown);
  const Bytes mouse{0x05, 0x01, 0x09, 0x02, 0xa1, 0x01, 0x85, 0x01,
                    0x75, 0x08, 0x95, 0x03, 0x81, 0x06, 0xc0};
  CHECK(layout_of_descriptor(mouse) == ReportLayout::unknown);
  for (std::size_t n = 0; n < 40; ++n)  // cut before all axes are described
    CHECK(layout_of_descriptor(std::span(split).first(n)) == ReportLayout::unknown);
}

TEST_CASE("overshoot is cut to full deflection") {
  SpaceMouseState s;
  take_report(Bytes{1} + int16s({-372, 351, 32767}), ReportLayout::split, s);
  take_report(Bytes{2} + int16s({-32768, 350, -350}), ReportLayout::split, s);
  CHECK(s.axis == Axes{-350, 350, 350, -350, 350, -350});
}

TEST_CASE("many buttons and the battery") {
  SpaceMouseState s;
  CHECK(take_report(Bytes{3, 0x01, 0x10, 0x00, 0x80, 0xff, 0xff}, ReportLayout::joint, s) ==
        ReportKind::buttons);
  CHECK(s.buttons == 0x80001001u);
  CHECK(s.battery == -1);
  CHECK(take_report(Bytes{0x17, 100}, ReportLayout::joint, s) == ReportKind::battery);
  CHECK(s.battery == 100);
  CHECK(!s.charging);
  CHECK(take_report(Bytes{0x17, 57, 1}, ReportLayout::joint, s) == ReportKind::battery);
  CHECK(s.battery == 57);
  CHECK(s.charging);
  CHECK(take_report(Bytes{0x17, 101}, ReportLayout::joint, s) == ReportKind::ignored);
  CHECK(s.battery == 57);
}

TEST_CASE("a report that is cut short is ignored and changes nothing") {
  SpaceMouseState before;
  before.axis = {1, 2, 3, 4, 5, 6};
  before.buttons = 5, before.battery = 7;
  const Bytes whole = Bytes{1} + int16s({100, 100, 100, 100, 100, 100});
  for (const ReportLayout layout : layouts)
    for (std::size_t n = 0; n < (layout == ReportLayout::joint ? 13u : 7u); ++n)
      for (const std::uint8_t id : {1, 2}) {
        Bytes cut(whole.begin(), whole.begin() + static_cast<long>(n));
        if (n > 0) cut[0] = id;
        SpaceMouseState s = before;
        CHECK(take_report(cut, layout, s) == ReportKind::ignored);
        CHECK(s == before);
      }
  for (const std::uint8_t id : {0x03, 0x17}) {
    SpaceMouseState s = before;
    CHECK(take_report(Bytes{id}, ReportLayout::split, s) == ReportKind::ignored);
    CHECK(s == before);
  }
}

TEST_CASE("a million random reports: states stay in range, ignored reports change nothing") {
  std::mt19937 random(20250701);
  SpaceMouseState s;
  std::size_t taken[4] = {};
  std::size_t wrong = 0;
  for (int i = 0; i < 1000000; ++i) {
    Bytes report(random() % 20);
    for (std::uint8_t& b : report) b = static_cast<std::uint8_t>(random());
    if (!report.empty() && random() % 4) report[0] = Bytes{1, 2, 3, 0x17}[random() % 4];
    const SpaceMouseState before = s;
    const ReportKind kind = take_report(report, layouts[random() % 3], s);
    ++taken[static_cast<int>(kind)];
    for (const int a : s.axis) wrong += a < -kSpaceMouseFull || a > kSpaceMouseFull;
    wrong += s.battery < -1 || s.battery > 100;
    if (kind == ReportKind::ignored) wrong += !(s == before);
  }
  CHECK(wrong == 0);
  for (const std::size_t n : taken)
    CHECK(n > 10000);  // the random bytes reached every kind of report
}

TEST_CASE("reading random and damaged descriptors always ends") {
  std::mt19937 random(7);
  std::size_t seen[3] = {};
  for (int i = 0; i < 200000; ++i) {
    Bytes d = h6::test::spacemouse_descriptor(random() % 2 != 0);
    if (random() % 8 == 0) {
      d.resize(random() % 200);
      for (std::uint8_t& b : d) b = static_cast<std::uint8_t>(random());
    }
    if (d.empty()) continue;
    for (unsigned n = random() % 3; n > 0; --n)
      d[random() % d.size()] = static_cast<std::uint8_t>(random());
    if (random() % 2) d.resize(random() % d.size());
    ++seen[static_cast<int>(layout_of_descriptor(d))];
  }
  for (const std::size_t n : seen) CHECK(n > 1000);
}

TEST_CASE("which devices are caps: by usage first, never a mouse or a keyboard of the same maker") {
  CHECK(is_spacemouse(0x046d, 0xc626, 1, 8));   // SpaceNavigator
  CHECK(is_spacemouse(0x256f, 0xc635, 1, 8));   // SpaceMouse Compact
  CHECK(is_spacemouse(0x256f, 0xc652, 1, 8));   // Universal Receiver, the interface of the cap
  CHECK(!is_spacemouse(0x256f, 0xc652, 1, 2));  // ... and that of a mouse
  CHECK(is_spacemouse(0x256f, 0xc6ff, 1, 8));   // a cap of tomorrow
  for (const int cad_mouse : {0xc650, 0xc651, 0xc654, 0xc655, 0xc656, 0xc657, 0xc658})
    CHECK(!is_spacemouse(0x256f, static_cast<std::uint16_t>(cad_mouse), 1, 8));
  CHECK(!is_spacemouse(0x046d, 0xc52b, 1, 8));  // another Logitech receiver
  CHECK(!is_spacemouse(0x046d, 0xc626, 1, 6));  // a keyboard's interface
  CHECK(!is_spacemouse(0x1234, 0xc626, 1, 8));
  CHECK(is_spacemouse(0x046d, 0xc626, 0, 0));  // no descriptor: the product decides
  CHECK(!is_spacemouse(0x256f, 0xc6ff, 0, 0));
}

TEST_CASE("the rules that the program prints are those of the file") {
  std::ifstream in(HAPSIX_SOURCE_DIR "/device/udev/70-hapsix.rules");
  const std::string file{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  CHECK(!file.empty());
  CHECK(file == udev_rules());
}
