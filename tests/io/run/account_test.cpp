// SPDX-License-Identifier: Apache-2.0
// The summary in a recording must follow from its rows.
#include "io/run/account.h"

#include <doctest/doctest.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "io/console/console.h"
#include "io/run/run_setup.h"
#include "io/scenes/scenes.h"
#include "tests/io/load.h"

using namespace h6;
using namespace h6::cli;

namespace {

struct Run {
  std::unique_ptr<io::LoadedScene> loaded = test::load(*io::make_scene("peg-in-hole"));
  std::vector<h6FrameRecord> rows;
  io::Recording recording;

  Run() {
    RunSetup setup(*loaded);
    const Outcome opened = setup.open();
    if (!opened) FAIL(opened.error());
    RunSummary summary;
    summary.seconds = 1.5;
    RunWatch watch(*loaded, 1000, summary, nullptr);
    for (int i = 0; i < 1500; ++i) {
      h6FrameRecord row{};
      row.time = 1e-3 * i;
      REQUIRE(setup.step(row));
      if (i == 700) row.late = H6_LATE_COMPUTE, row.cpu_us = 2000;
      if (i == 800) row.late = H6_LATE_STOLEN;
      if (i == 900) watch.note("mark", "a note of the user");
      rows.push_back(row);
      (void)watch.rows(&row, nullptr, 1);
    }
    watch.finish({});
    recording.head.rate = 1000;
    recording.frame_count = rows.size();
    recording.events = summary.events;
    recording.summary_json = Console::text(to_json(summary, *loaded, true));
  }
  std::string difference(const std::function<void(io::Recording&)>& change = {}) {
    io::Recording said = recording;
    if (change) change(said);
    Account account(*loaded, said, true);
    for (const h6FrameRecord& row : rows) account.row(row);
    return account.first_difference({});
  }
};

// Replaces a figure of the summary.
auto figure(const char* key, const nlohmann::json& value) {
  return [=](io::Recording& said) {
    auto all = nlohmann::ordered_json::parse(said.summary_json);
    all[key] = value;
    said.summary_json = all.dump();
  };
}

}  // namespace

TEST_CASE("events and figures that were changed are found among those that follow from the rows") {
  Run run;
  REQUIRE(run.recording.events.size() > 3);
  CHECK(run.difference() == "");
  CHECK(run.difference([](io::Recording& r) { r.events[1].time += 1e-3; }).find("event 1 (") == 0);
  CHECK(run.difference([](io::Recording& r) { r.events[2].detail += "0"; }).find("event 2 (") == 0);
  CHECK(run.difference([](io::Recording& r) { r.events.erase(r.events.begin()); }) != "");
  CHECK(run.difference([](io::Recording& r) { r.events.push_back(r.events[0]); }) != "");
  CHECK(run.difference(figure("max_force", 1e-3)) == "max_force of its summary");
  CHECK(run.difference(figure("verdict", "free")) == "verdict of its summary");
  CHECK(run.difference(figure("state_hash", "0")) == "state_hash of its summary");
  // A note is the user's own, and so is a figure that only the clock knows.
  CHECK(run.difference([](io::Recording& r) {
    for (io::RecordingEvent& e : r.events)
      if (e.what == "mark") e.detail += "!";
  }) == "");
  CHECK(run.difference(figure("realtime", "")) == "");
}

TEST_CASE("a killed run has no summary, and its events may be ahead of its rows") {
  Run run;
  const auto killed = [&](std::size_t rows_left) {
    return run.difference([&](io::Recording& said) {
      said.whole = false;
      said.summary_json.clear();
      run.rows.resize(rows_left);
    });
  };
  CHECK(killed(1400) == "");
  CHECK(killed(100) == "");
}
