// SPDX-License-Identifier: Apache-2.0
// The frames around a late frame tell why it was late.
#include "io/record/late_judge.h"

#include <doctest/doctest.h>

#include <vector>

using namespace h6::io;

namespace {

h6FrameRecord row(std::uint64_t frame, double cpu_us, std::uint32_t contacts,
                  std::uint32_t late = 0) {
  h6FrameRecord r{};
  r.time = 1e-3 * static_cast<double>(frame);
  r.report.frame = frame;
  r.report.contacts = contacts;
  r.report.substeps = 1;
  r.cpu_us = cpu_us, r.late = late;
  r.late_us = late ? cpu_us - 1000 : 0;
  return r;
}

std::vector<LateFrame> judged(const std::vector<h6FrameRecord>& rows) {
  std::vector<LateFrame> all;
  LateJudge judge(1000);
  const auto tell = [&](const LateFrame& late) { all.push_back(late); };
  for (const h6FrameRecord& r : rows) judge.row(r, tell);
  judge.finish(tell);
  return all;
}

// 300 frames of 40 us, with `odd` in place of number 150.
std::vector<h6FrameRecord> calm(const h6FrameRecord& odd) {
  std::vector<h6FrameRecord> rows;
  for (std::uint64_t i = 0; i < 300; ++i)
    rows.push_back(i == 150 ? odd : row(i, 40, 100 + static_cast<std::uint32_t>(i % 5)));
  return rows;
}

}  // namespace

TEST_CASE("a long frame among short ones with as many contacts was made late by the machine") {
  const auto all = judged(calm(row(150, 9000, 100, H6_LATE_COMPUTE)));
  REQUIRE(all.size() == 1);
  CHECK(all[0].cause == LateCause::machine);
  CHECK(all[0].frame == 150);
  CHECK(all[0].like == 2 * LateJudge::kNear);
  CHECK(all[0].like_us == 40);
  CHECK(all[0].sentence() ==
        "frame 150 ended 8000 us after its deadline: began 0 us late, used 9000 us, while 128 "
        "frames around it with as much to do used 40 us at most");
}

TEST_CASE("a frame that is one of many long ones was late by its own work") {
  std::vector<h6FrameRecord> rows;
  for (std::uint64_t i = 0; i < 300; ++i)
    rows.push_back(i % 2 ? row(i, 900, 5000) : row(i, 1100, 5000, H6_LATE_COMPUTE));
  const auto all = judged(rows);
  REQUIRE(all.size() == 150);
  for (const LateFrame& late : all) CHECK(late.cause == LateCause::own);
}

TEST_CASE("without frames that had as much to do, or with some half as long, there is doubt") {
  for (const h6FrameRecord& odd :
       {row(150, 9000, 500, H6_LATE_COMPUTE), row(150, 1100, 100, H6_LATE_COMPUTE)}) {
    auto rows = calm(odd);
    if (odd.report.contacts == 100) rows[120].cpu_us = 400;
    const auto all = judged(rows);
    REQUIRE(all.size() == 1);
    CHECK(all[0].cause == LateCause::doubt);
  }
  // All frames around it are late, too: a machine that stalls on and on.
  std::vector<h6FrameRecord> rows;
  for (std::uint64_t i = 0; i < 50; ++i) rows.push_back(row(i, 3000, 10, H6_LATE_COMPUTE));
  for (const LateFrame& late : judged(rows)) CHECK(late.cause == LateCause::doubt);
}

TEST_CASE(
    "stepped again, a frame in doubt shows whose time it was; near a period the doubt stays") {
  const auto doubtful = [] { return judged(calm(row(150, 9000, 500, H6_LATE_COMPUTE))).at(0); };
  LateFrame dear = doubtful(), cheap = doubtful(), near = doubtful();
  CHECK(dear.again_us < 0);
  dear.stepped_again(1200, 1000);
  cheap.stepped_again(80, 1000);
  near.stepped_again(700, 1000);
  CHECK(dear.cause == LateCause::own);
  CHECK(cheap.cause == LateCause::machine);
  CHECK(near.cause == LateCause::doubt);
  CHECK(near.again_us == 700);
  // The processor's scheduler said it; a frame stepped again says nothing else.
  LateFrame stolen = judged(calm(row(150, 9000, 500, H6_LATE_STOLEN))).at(0);
  stolen.stepped_again(1200, 1000);
  CHECK(stolen.cause == LateCause::stolen);
}

TEST_CASE("the clock's other causes stay, and each late frame is told once and in order") {
  std::vector<h6FrameRecord> rows;
  for (std::uint64_t i = 0; i < 1000; ++i)
    rows.push_back(row(i, 30, 10, i % 7 == 0 ? H6_LATE_STOLEN : i % 11 == 0 ? H6_LATE_WAKEUP : 0));
  const auto all = judged(rows);
  std::size_t at = 0;
  for (const h6FrameRecord& r : rows) {
    if (!r.late) continue;
    REQUIRE(at < all.size());
    CHECK(all[at].frame == r.report.frame);
    CHECK(all[at].cause == (r.late == H6_LATE_STOLEN ? LateCause::stolen : LateCause::wakeup));
    ++at;
  }
  CHECK(at == all.size());
}
