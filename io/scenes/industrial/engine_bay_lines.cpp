// SPDX-License-Identifier: Apache-2.0
// engine_bay_lines.cpp - bundles of wires two voxels thick, brake and fuel lines.
#include "io/scenes/industrial/engine_bay.h"

namespace h6::io::industrial {
namespace {

void add_plug(Assembly& a, const h6Vec3& where, const h6Vec3& direction) {
  const Frame plug = facing(where, direction, {0, 0, 1});
  a.add("connector", block(16, 20, 22, 2.5, 1.5, 2), plug * at(0, 0, -8));
  a.add("connector latch", block(6, 4, 14, 1, 0.6, 2), plug * at(0, 11, -4));
}

void add_wire_to(Assembly& a, const std::string& name, const std::vector<h6Vec3>& through) {
  a.add_wire(name, smooth(through, 8), kBayWire);
  add_plug(a, through.back(), through.back() - through[through.size() - 2]);
}

void add_bundles(Assembly& a) {
  add_bundle(a, "engine harness",
             {{318, -30, 372},
              {288, 0, 400},
              {240, 70, 452},
              {160, 150, 506},
              {60, 163, 508},
              {-120, 163, 508},
              {-226, 150, 500},
              {-262, 96, 480},
              {-284, 40, 452},
              {-300, 20, 420}},
             13, kBayWire);
  add_bundle(a, "front harness",
             {{330, -112, 400},
              {300, -106, 430},
              {244, -112, 440},
              {232, -200, 452},
              {226, -296, 476},
              {120, -324, 494},
              {-120, -324, 494},
              {-260, -326, 496},
              {-350, -338, 460},
              {-410, -350, 400}},
             7, kBayWire);
  add_bundle(a, "injection harness",
             {{240, 70, 452},
              {160, -20, 520},
              {110, -76, 524},
              {0, -80, 526},
              {-120, -80, 526},
              {-214, -80, 524}},
             7, kBayWire);
  add_bundle(a, "dash harness",
             {{330, 36, 360}, {300, 90, 340}, {262, 220, 330}, {252, 330, 370}, {250, 374, 380}},
             13, kBayWire);
  add_bundle(a, "gearbox harness",
             {{318, -30, 372}, {290, 40, 380}, {270, 80, 374}, {240, 60, 362}, {214, 20, 366}}, 5,
             kBayWire);
  for (const double x : {-190.0, -110.0, -30.0, 50.0}) {
    for (const double dx : {-3.0, 0.0, 3.0})
      add_wire_to(a, "coil wire",
                  {{x + 30 + dx, 163, 509},
                   {x + 24 + dx, 156, 536},
                   {x + 14 + dx, 128, 548},
                   {x + 12 + dx, 110, 541}});
    for (const double dx : {-2.5, 2.5})
      add_wire_to(a, "injector wire",
                  {{x + 44 + dx, -80, 527},
                   {x + 40 + dx, -96, 532},
                   {x + 28 + dx, -116, 514},
                   {x + 24 + dx, -110, 486}});
  }
  add_wire_to(a, "alternator wire",
              {{-284, 40, 452},
               {-290, -20, 440},
               {-262, -90, 420},
               {-190, -104, 416},
               {-140, -130, 390},
               {-130, -126, 366}});
  add_wire_to(a, "throttle wire",
              {{-214, -80, 524}, {-240, -110, 520}, {-284, -170, 490}, {-282, -198, 428}});
  add_wire_to(a, "oxygen sensor wire",
              {{-120, 163, 508}, {-90, 200, 470}, {0, 270, 380}, {8, 272, 332}});
  add_wire_to(a, "fan wire",
              {{226, -296, 476}, {200, -296, 420}, {150, -290, 330}, {132, -284, 292}});
  add_wire_to(a, "fan wire",
              {{-120, -324, 494}, {-126, -300, 420}, {-130, -290, 330}, {-132, -284, 292}});
  add_wire_to(
      a, "oil pressure wire",
      {{-262, 96, 480}, {-256, 170, 440}, {-210, 190, 300}, {-150, 178, 240}, {-120, 164, 230}});
}

void add_lines(Assembly& a) {
  // Brake lines run side by side from the pressure unit along the firewall, two voxels thick.
  for (int i = 0; i < 4; ++i) {
    const double z = 270 - 7.0 * i, x = 342 + 30.0 * (i % 3), y = 290 + 30.0 * (i / 3);
    a.add_wire("brake line " + std::to_string(i + 1),
               smooth({{x, y, 380},
                       {x - 8, y + 6, 402},
                       {x - 40, y + 16, 404 - 5.0 * i},
                       {250 - 9.0 * i, 352, 330},
                       {200, 364, z},
                       {0, 366, z},
                       {-200, 366, z},
                       {-340 - 6.0 * i, 362, z - 10},
                       {-388 - 5.0 * i, 330, 200 - 9.0 * i},
                       {-396 - 5.0 * i, 260, 170 - 9.0 * i}},
                      9),
               kBayWire);
  }
  for (const double x : {-120.0, 0.0, 120.0, 190.0}) {
    a.add("line clip", block(14, 34, 6, 3, 1), facing({x, 371, 260}, {0, -1, 0}, {1, 0, 0}));
    add_bolt(a, "line clip bolt", facing({x, 365, 284}, {0, -1, 0}), 5, 14);
  }
  for (const double side : {0.0, 1.0})
    a.add("fuel line", rod(smooth({{160 + 12 * side, 372, 150},
                                   {160 + 12 * side, 340, 190},
                                   {176, 250 + 10 * side, 330},
                                   {170, 190, 440 + 8 * side},
                                   {130, 60, 540 + 8 * side},
                                   {104, -60, 530},
                                   {84, -100, 506 + 6 * side}},
                                  6),
                           4, 14));
  // Cables with lugs: to the fuse box, to the starter's post on the gearbox, and to the body.
  a.add("battery cable",
        rod(smooth({{370, -149, 455}, {350, -120, 466}, {340, -96, 430}, {352, -80, 398}}, 5), 5.5,
            18));
  a.add("battery cable", rod(smooth({{362, -301, 455},
                                     {330, -322, 460},
                                     {262, -330, 420},
                                     {236, -240, 330},
                                     {240, -140, 320},
                                     {250, -70, 322}},
                                    5),
                             5.5, 18));
  a.add("ground strap",
        sweep(smooth({{260, 110, 330}, {300, 130, 350}, {360, 100, 330}, {410, 60, 280}}, 5),
              rectangle(14, 3, 1.2, 2), {0, 0, 1}, Ends::capped));
  // Clutch and throttle cables, bellows at the end.
  a.add(
      "gear cable",
      rod(smooth(
              {{320, 60, 362}, {340, 100, 364}, {300, 240, 350}, {260, 330, 300}, {250, 374, 290}},
              5),
          4, 14));
  a.add("dipstick tube",
        rod(smooth({{74, 160, 170}, {78, 180, 240}, {76, 184, 330}, {72, 182, 420}, {66, 184, 500}},
                   5),
            4.5, 16));
  a.add("dipstick handle", rod(helix(11, 0.4, 1, 36), 2.2, 12), facing({66, 184, 512}, {1, 0, 0}));
}

}  // namespace

void add_harness(Assembly& a) {
  add_bundles(a);
  add_lines(a);
}

}  // namespace h6::io::industrial
