// SPDX-License-Identifier: Apache-2.0
// What the page for picking vertices gets, and what it may answer.
#include "io/view/pick.h"

#include <doctest/doctest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "io/view/pick_request.h"

using namespace h6;
using namespace h6::io::view;

TEST_CASE(
    "a choice of vertices comes sorted and each once, and a refusal to choose is understood") {
  const Result<Picked> some = parse_picked(R"({"do": "use", "vertices": [7, 2, 7, 0]})", 8);
  REQUIRE(some);
  CHECK(some->use);
  CHECK(some->vertices == std::vector<std::uint32_t>{0, 2, 7});
  const Result<Picked> none = parse_picked(R"({"do": "cancel"})", 8);
  REQUIRE(none);
  CHECK_FALSE(none->use);
}

TEST_CASE("a text that is no choice is refused in one sentence") {
  for (const char* text :
       {"", "{", "[]", "7", R"({"do": 1})", R"({"do": "use"})", R"({"do": "use", "vertices": 3})",
        R"({"do": "use", "vertices": []})", R"({"do": "use", "vertices": [8]})",
        R"({"do": "use", "vertices": [-1]})", R"({"do": "use", "vertices": [1.5]})",
        R"({"do": "use", "vertices": ["1"]})", R"({"do": "use", "vertices": [4294967296]})",
        R"({"do": "use", "vertices": [[1]]})", R"({"do": "erase", "vertices": [1]})"}) {
    const Result<Picked> picked = parse_picked(text, 8);
    REQUIRE_MESSAGE(!picked, text);
    CHECK(picked.error().find('\n') == std::string::npos);
  }
}

TEST_CASE("the page gets positions about the middle in parts of the radius, and how to undo that") {
  Pickable model;
  model.name = "bar.veg", model.unit = "mm", model.metres = 1e-3;
  model.vertices = {{1, 2, 3}, {1.06, 2, 3}, {1, 2.08, 3}};
  model.triangles = {0, 1, 2};
  model.marked = {1};
  const Message message = solid_message(model);
  std::uint32_t size = 0;
  std::memcpy(&size, message->data(), 4);
  const auto head = nlohmann::json::parse(message->substr(4, size));
  CHECK(head["kind"] == "solid");
  CHECK(head["vertices"] == 3);
  CHECK(head["unit"] == "mm");
  const double radius = head["radius"];
  CHECK(radius == doctest::Approx(0.05));
  float place[9];
  std::memcpy(place, message->data() + 4 + size, sizeof place);
  for (std::size_t v = 0; v < 3; ++v) {
    const double* p = &model.vertices[v].x;
    for (std::size_t i = 0; i < 3; ++i)
      CHECK(head["origin"][i].get<double>() + radius * place[3 * v + i] ==
            doctest::Approx(p[i]).epsilon(1e-8));
  }
}
