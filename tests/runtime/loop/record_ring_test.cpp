// SPDX-License-Identifier: Apache-2.0
// Records of frames pass to a reader that may be too slow: whole, as inputs, or counted as lost.
#include "runtime/loop/record_ring.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <random>
#include <thread>
#include <vector>

using namespace h6;

namespace {

h6FrameRecord record(std::uint64_t frame, std::size_t hands) {
  h6FrameRecord r{};
  r.time = 1e-3 * static_cast<double>(frame);
  r.report.frame = frame;
  r.report.contacts = 7;
  r.report.coarse_pairs = static_cast<std::uint32_t>(frame % 5);
  r.settings = static_cast<std::uint32_t>(frame / 100);
  for (std::size_t h = 0; h < hands; ++h) {
    r.hand[h].pose.p.x = static_cast<double>(frame * 10 + h);
    r.hand[h].sequence = static_cast<std::uint32_t>(frame);
    r.safety_input[h] = {static_cast<std::uint32_t>(frame % 7), 1e-4 * static_cast<double>(h)};
    r.command[h].cause = H6_CAUSE_LATE;
    r.command[h].causes = 1u << H6_CAUSE_LATE;
    r.command[h].wrench.force.z = 3;
  }
  return r;
}

// Whether a row is that of its frame, whole or with all that repeats the frame.
bool right(const h6FrameRecord& row, std::size_t hands) {
  const h6FrameRecord all = record(row.report.frame, hands);
  bool good = row.time == all.time && row.settings == all.settings &&
              row.report.coarse_pairs == all.report.coarse_pairs;
  for (std::size_t h = 0; h < hands; ++h)
    good = good && std::memcmp(&row.hand[h], &all.hand[h], sizeof row.hand[h]) == 0 &&
           row.safety_input[h].asked == all.safety_input[h].asked &&
           row.safety_input[h].overdue == all.safety_input[h].overdue &&
           row.command[h].cause == all.command[h].cause &&
           row.command[h].causes == all.command[h].causes &&
           row.command[h].wrench.force.z == (row.inputs_only ? 0 : 3);
  return good && row.report.contacts == (row.inputs_only ? 0 : 7);
}

// q of the bodies that bend after a frame.
std::vector<double> bends(std::uint64_t frame, std::size_t modes) {
  std::vector<double> q;
  for (std::size_t j = 0; j < modes; ++j) q.push_back(static_cast<double>(frame * 100 + j));
  return q;
}

bool right(const h6FrameRecord& row, const double* q, std::size_t modes) {
  const std::vector<double> all = bends(row.report.frame, modes);
  for (std::size_t j = 0; j < modes; ++j)
    if (row.inputs_only ? !std::isnan(q[j]) : q[j] != all[j]) return false;
  return true;
}

}  // namespace

TEST_CASE("whatever the reader does, frames come in order, each whole or with its inputs") {
  std::mt19937_64 random(4);
  for (int run = 0; run < 300; ++run) {
    const std::size_t hands = random() % 4, records = random() % 9, inputs = random() % 9;
    const std::size_t modes = random() % 4;
    RecordRing ring(1 + records, inputs, hands, modes);
    std::vector<h6FrameRecord> some(16), got;
    std::vector<double> q(16 * modes);
    std::uint64_t pushed = 0;
    for (int turn = 0; turn < 60; ++turn) {
      for (std::size_t n = random() % 6; n > 0; --n, ++pushed)
        ring.push(record(pushed, hands), bends(pushed, modes).data());
      const bool asked = random() % 4 > 0;
      const std::size_t n = ring.pop(some.data(), asked ? q.data() : nullptr, random() % 7);
      for (std::size_t i = 0; i < n && asked; ++i)
        REQUIRE(right(some[i], q.data() + i * modes, modes));
      got.insert(got.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(n));
    }
    while (const std::size_t n = ring.pop(some.data(), q.data(), some.size()))
      got.insert(got.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(n));
    std::uint64_t short_ones = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
      REQUIRE(right(got[i], hands));
      if (i > 0) REQUIRE(got[i].report.frame > got[i - 1].report.frame);
      short_ones += got[i].inputs_only;
    }
    REQUIRE(short_ones == ring.inputs_only());
    REQUIRE(got.size() + ring.lost() == pushed);
    // The first frames had room.
    REQUIRE(got.size() >= std::min<std::size_t>(pushed, 1 + records + inputs));
  }
}

TEST_CASE("between two threads no frame is lost before both rings are full, torn or out of turn") {
  constexpr std::uint64_t count = 100000;
  for (const std::size_t hands : {1, 3}) {
    const std::size_t modes = 2 * hands;
    RecordRing ring(8, 500, hands, modes);
    std::atomic<std::uint64_t> read{0};
    std::thread writer([&] {
      for (std::uint64_t i = 0; i < count; ++i) {
        while (i - read.load() > 500) std::this_thread::yield();
        ring.push(record(i, hands), bends(i, modes).data());
      }
    });
    std::vector<h6FrameRecord> some(32);
    std::vector<double> q(32 * modes);
    std::uint64_t next = 0, short_ones = 0;
    bool good = true;
    while (next < count) {
      const std::size_t n = ring.pop(some.data(), q.data(), some.size());
      for (std::size_t i = 0; i < n; ++i) {
        good = good && some[i].report.frame == next && right(some[i], hands) &&
               right(some[i], &q[i * modes], modes);
        ++next;
        short_ones += some[i].inputs_only;
      }
      read = next;
      if (n == 0) std::this_thread::yield();
    }
    writer.join();
    CHECK(good);
    CHECK(ring.lost() == 0);
    CHECK(short_ones == ring.inputs_only());
    CHECK(short_ones > 0);
  }
}
