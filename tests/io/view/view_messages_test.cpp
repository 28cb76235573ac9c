// SPDX-License-Identifier: Apache-2.0
// The messages between page and program: requests from an untrusted text, envelopes, timelines.
#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "io/view/envelope.h"
#include "io/view/page.h"
#include "io/view/trace.h"
#include "io/view/view_request.h"

using namespace h6::io::view;
using nlohmann::json;

namespace {

template <class T>
const T* asked(const h6::Result<ViewRequest>& r) {
  return r ? std::get_if<T>(&*r) : nullptr;
}

}  // namespace

TEST_CASE("the pages keep the notices of the packages they contain") {
  if (live_page().empty()) {
    MESSAGE("skipped: built without node and npm");
    return;
  }
  for (const std::string_view page : {live_page(), report_page()})
    for (const char* notice :
         {"three.js authors", "Copyright (c) 2022 Leon Sorokin", "Permission is hereby granted"})
      CHECK_MESSAGE(page.find(notice) != page.npos, notice);
}

TEST_CASE("each request is parsed into its members") {
  const auto grab = parse_request(R"({"do":"grab","on":true})");
  REQUIRE(asked<Grab>(grab));
  CHECK(asked<Grab>(grab)->on);
  const auto set = parse_request(R"({"do":"contact","method":"gauss6+facing","stiffness":2e4})");
  REQUIRE(asked<SetContact>(set));
  CHECK(asked<SetContact>(set)->method == "gauss6+facing");
  CHECK(asked<SetContact>(set)->stiffness == 2e4);
  CHECK(asked<SetContact>(set)->epsilon == 0);  // unchanged
  const auto hand = parse_request(R"({"do":"contact","hand_stiffness":500})");
  REQUIRE(asked<SetContact>(hand));
  CHECK(asked<SetContact>(hand)->hand_stiffness == 500);
  CHECK(asked<Keep>(parse_request(R"({"do":"keep"})")));
  CHECK(asked<GoBack>(parse_request(R"({"do":"back"})")));
  CHECK(asked<Reset>(parse_request(R"({"do":"reset"})")));
  const auto slice = parse_request(R"({"do":"slice","axis":1,"at":0.25})");
  REQUIRE(asked<Slice>(slice));
  CHECK(asked<Slice>(slice)->axis == 1);
}

TEST_CASE(
    "a hand's quaternion is made unit length; poses that are not finite or too far are refused") {
  const auto hand = parse_request(R"({"do":"hand","p":[0.1,-2,3e-3],"q":[0.8,0,0.6001,0]})");
  REQUIRE(asked<MoveHand>(hand));
  const h6Pose& p = asked<MoveHand>(hand)->pose;
  CHECK(p.p.y == -2);
  CHECK(std::fabs(p.q.w * p.q.w + p.q.x * p.q.x + p.q.y * p.q.y + p.q.z * p.q.z - 1) < 1e-12);
  for (const char* wrong :
       {R"({"do":"hand","p":[0,0],"q":[1,0,0,0]})", R"({"do":"hand","p":[0,0,1e9],"q":[1,0,0,0]})",
        R"({"do":"hand","p":[0,0,"1"],"q":[1,0,0,0]})",
        R"({"do":"hand","p":[0,0,0],"q":[0,0,0,0]})",
        R"({"do":"hand","p":[0,0,1e999],"q":[1,0,0,0]})",
        R"({"do":"hand","p":[0,0,null],"q":[1,0,0,0]})"})
    CHECK_MESSAGE(!parse_request(wrong), wrong);
}

TEST_CASE("a member that is out of range, of another type or unknown gives one sentence") {
  for (const char* wrong :
       {"", "[]", "null", "{", R"({"do":1})", R"({"do":"fly"})", R"({"do":"grab","on":1})",
        R"({"do":"pace","pace":2})", R"({"do":"pace","pace":-0.1})",
        R"({"do":"contact","method":"best"})", R"({"do":"contact","stiffness":-5})",
        R"({"do":"contact","stiffness":1e30})", R"({"do":"contact","epsilon":5})",
        R"({"do":"contact","hand_stiffness":-1})", R"({"do":"contact","hand_stiffness":1e7})",
        R"({"do":"contact","max_depth_voxels":0})", R"({"do":"slice","axis":3,"at":0.5})",
        R"({"do":"slice","axis":1.5,"at":0.5})", R"({"do":"slice","axis":0,"at":1.01})",
        R"({"do":"record"})"}) {
    const auto result = parse_request(wrong);
    REQUIRE_MESSAGE(!result, wrong);
    CHECK(result.error().find("not understood") != std::string::npos);
    CHECK(result.error().size() < 200);
  }
}

TEST_CASE("1e5 fuzzed requests: no crash, and every accepted number is finite and in range") {
  std::mt19937 random(3);
  const std::string seeds[] = {
      R"({"do":"hand","p":[0.1,-2,3e-3],"q":[0.8,0,0.6,0]})",
      R"({"do":"contact","method":"gauss6+facing","stiffness":1e4,"epsilon":0.1})",
      R"({"do":"pace","pace":0.5})", R"({"do":"slice","axis":1,"at":0.25})"};
  const std::string words[] = {"1e308", "-1e308", "NaN",    "null", "[[[[", "]",
                               "\"",    "{",      "1e-400", "\xff", "-0"};
  std::size_t through = 0;
  for (int i = 0; i < 100000; ++i) {
    std::string text = seeds[random() % std::size(seeds)];
    for (unsigned k = random() % 4; k > 0; --k) {
      const std::size_t at = random() % (text.size() + 1);
      switch (random() % 3) {
        case 0:
          text.insert(at, words[random() % std::size(words)]);
          break;
        case 1:
          text.erase(at, random() % 5);
          break;
        default:
          if (at < text.size()) text[at] = static_cast<char>(random());
      }
    }
    const auto result = parse_request(text);
    if (!result) continue;
    ++through;
    if (const auto* hand = asked<MoveHand>(result)) {
      const h6Vec3& p = hand->pose.p;
      CHECK((std::isfinite(p.x + p.y + p.z) && std::fabs(p.x) <= 1e3));
    }
    if (const auto* pace = asked<SetPace>(result)) CHECK((pace->pace >= 0 && pace->pace <= 1));
    if (const auto* c = asked<SetContact>(result)) {
      CHECK((c->stiffness >= 0 && c->stiffness <= 1e6));
      CHECK((c->epsilon >= 0 && c->epsilon <= 2));
    }
  }
  CHECK(through > 10000);  // the fuzzer also makes valid requests
}

TEST_CASE("deeply nested requests do not use up the stack") {
  CHECK(!parse_request(std::string(4000, '[')));
  CHECK(!parse_request("{\"do\":" + std::string(4000, '{')));
}

TEST_CASE("an envelope unpacks into the arrays that were added") {
  Envelope envelope;
  envelope.add("f", std::vector<float>{1.5f, -2});
  envelope.add("b", std::vector<std::uint8_t>{1, 2, 3});  // padded to four
  envelope.add("s", std::vector<std::int16_t>{-5});
  envelope.add("none", std::vector<std::uint32_t>{});
  envelope.add("u", std::vector<std::uint32_t>{4000000000u});
  const std::string packed = envelope.pack({{"kind", "test"}});
  std::uint32_t size;
  std::memcpy(&size, packed.data(), 4);
  CHECK(size % 4 == 0);
  const json head = json::parse(packed.substr(4, size));
  CHECK(head["kind"] == "test");
  std::size_t at = 4 + size;
  for (const json& a : head["arrays"]) {
    const std::size_t wide = a["type"] == "u8" ? 1 : a["type"] == "i16" ? 2 : 4;
    const std::size_t bytes = wide * a["count"].get<std::size_t>();
    if (a["name"] == "f") {
      float f[2];
      std::memcpy(f, packed.data() + at, 8);
      CHECK((f[0] == 1.5f && f[1] == -2));
    }
    if (a["name"] == "u") {
      std::uint32_t u;
      std::memcpy(&u, packed.data() + at, 4);
      CHECK(u == 4000000000u);
    }
    CHECK(at % 4 == 0);
    at += (bytes + 3) / 4 * 4;
  }
  CHECK(at == packed.size());
}

TEST_CASE("a timeline has each of the last frames with its stages, in order, inside the frame") {
  Trace trace(100);
  for (int i = 0; i < 250; ++i) {
    h6FrameRecord r{};
    r.time = 1e-3 * i;
    r.report.frame = static_cast<std::uint64_t>(i);
    r.report.frame_us = 50;
    r.wakeup_us = 5;
    for (double& us : r.report.stage_us) us = 6;
    if (i == 200) r.late = H6_LATE_STOLEN;
    if (i % 2) r.report.helper_slices = 3, r.report.helper_start_us = 4, r.report.helper_us = 9;
    trace.add(&r, 1);
  }
  const auto file = std::filesystem::temp_directory_path() /
                    ("hapsix-trace-" + std::to_string(std::random_device{}()) + ".json");
  REQUIRE(trace.write(file));
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  std::filesystem::remove(file);
  const json all = json::parse(text.str());
  int frames = 0, late = 0, helped = 0;
  double start = 0, end = 0;
  for (const json& e : all["traceEvents"]) {
    if (e["ph"] == "i") ++late;
    if (e["ph"] != "X" || e["name"] == "wake-up") continue;
    if (e["tid"] == 2) {
      ++helped;
      continue;
    }
    const double ts = e["ts"], dur = e["dur"];
    if (e["name"] == "frame") {
      ++frames;
      CHECK(ts >= end);
      start = ts, end = ts + dur;
    } else {
      CHECK((ts >= start - 1e-6 && ts + dur <= end + 1e-6));
      start = ts + dur;  // stages follow one another
    }
  }
  CHECK(frames == 100);
  CHECK(late == 1);
  CHECK(helped == 50);
}
