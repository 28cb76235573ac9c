// SPDX-License-Identifier: Apache-2.0
// Tests the data of a report's page about a run that popped through.
#include <doctest/doctest.h>

#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "io/file/gunzip.h"
#include "io/view/page.h"
#include "io/view/report.h"

using namespace h6;
using namespace h6::io;
using nlohmann::json;

namespace {

std::string from_base64(const std::string& text) {
  static const std::string digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : text) {
    const std::size_t digit = digits.find(c);
    if (digit == digits.npos) continue;
    word = word << 6 | static_cast<std::uint32_t>(digit), bits += 6;
    if (bits >= 8) bits -= 8, out.push_back(static_cast<char>(word >> bits & 255));
  }
  return out;
}

view::ReportRun run_of(const std::vector<h6FrameRecord>& frames, const std::string& summary,
                       double again_us = -1) {
  RecordingHead head;
  head.rate = 1000, head.hands = 1;
  view::ReportRun run("run", head, frames.size());
  if (again_us >= 0) run.stepped_again(frames.front().report.frame, again_us);
  run.add(frames);
  run.events({{0.25, "through", "what"}}, summary);
  return run;
}

// The head of the data in the report of this run.
json head_of(view::ReportRun run) {
  std::vector<view::ReportRun> runs;
  runs.push_back(std::move(run));
  const Result<std::string> html = view::make_report(runs, nullptr, "");
  REQUIRE(html);
  const std::string mark = "id=\"data\">";
  const std::size_t begin = html->find(mark) + mark.size();
  const auto data =
      gunzip(from_base64(html->substr(begin, html->find("<", begin) - begin)), "the data");
  REQUIRE(data);
  std::uint32_t bytes;
  std::memcpy(&bytes, data->data(), sizeof bytes);
  return json::parse(data->substr(sizeof bytes, bytes));
}

}  // namespace

TEST_CASE("a report marks in metres where a point passed through, when its summary says so") {
  if (view::report_page().empty()) {
    MESSAGE("skipped: built without node and npm");
    return;
  }
  const std::vector<h6FrameRecord> two(2);
  const json run = head_of(run_of(two, R"({"verdict": "through", "units": "mm", "pop_through":
      {"computed": true, "first": {"time": 0.25, "place": [1, 2, -3000]}}})"))["runs"][0];
  CHECK(run["verdict"] == "through");
  CHECK(run["through"]["t"] == 0.25);
  CHECK(run["through"]["place"][1].get<double>() == doctest::Approx(2e-3));
  CHECK(run["through"]["place"][2].get<double>() == doctest::Approx(-3));
  CHECK(run["events"][0]["what"] == "through");
  // Older recordings, interrupted ones, and those that nothing passed through.
  for (const char* summary :
       {"", "{}", R"({"units": "mm", "pop_through": {"first": null}})",
        R"({"units": "yard", "pop_through": {"first": {"time": 1, "place": [0, 0, 0]}}})",
        R"({"units": "mm", "pop_through": {"first": {"time": "now", "place": 7}}})"})
    CHECK(head_of(run_of(two, summary))["runs"][0]["through"].is_null());
}

TEST_CASE("a report says what a late frame took when it was stepped again, and whose time it was") {
  if (view::report_page().empty()) {
    MESSAGE("skipped: built without node and npm");
    return;
  }
  h6FrameRecord late{};
  late.report.frame = 7;
  late.late = H6_LATE_COMPUTE, late.late_us = 500, late.cpu_us = 1500;
  const auto told = [&](double again_us) {
    return head_of(run_of({late}, "", again_us))["runs"][0]["late_frames"][0];
  };
  CHECK(told(-1)["again_us"].is_null());
  CHECK(told(-1)["cause"] == "own computation or the machine");
  CHECK(told(40)["again_us"] == 40);
  CHECK(told(40)["cause"] == "the machine");
  CHECK(told(1400)["cause"] == "own computation");
}
