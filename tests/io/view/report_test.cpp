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

// The head of the data in the report of one run with this summary.
json head_of(const std::string& summary) {
  RecordingHead head;
  head.rate = 1000, head.hands = 1;
  view::ReportRun run("run", head, 2);
  run.add(std::vector<h6FrameRecord>(2));
  run.events({{0.25, "through", "what"}}, summary);
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
  const json run = head_of(R"({"verdict": "through", "units": "mm", "pop_through":
      {"computed": true, "first": {"time": 0.25, "place": [1, 2, -3000]}}})")["runs"][0];
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
    CHECK(head_of(summary)["runs"][0]["through"].is_null());
}
