// SPDX-License-Identifier: Apache-2.0
// The advice of `hapsix new` after a trial that did not go well.
#include <doctest/doctest.h>

#include <regex>
#include <set>
#include <string>

#include "io/propose/doubt.h"
#include "io/scene/scene_file.h"

using namespace h6::io;

namespace {

constexpr Verdict kAll[] = {Verdict::unstable,  Verdict::through, Verdict::chatters,
                            Verdict::sunk,      Verdict::arrived, Verdict::stuck,
                            Verdict::untouched, Verdict::unheld,  Verdict::held};

}  // namespace

TEST_CASE("a trial that went wrong is doubted, and one that held is not") {
  std::set<Verdict> doubted;
  for (const Verdict verdict : kAll)
    if (doubt_of(verdict)) doubted.insert(verdict);
  CHECK(doubted == std::set<Verdict>{Verdict::unstable, Verdict::through, Verdict::chatters,
                                     Verdict::sunk, Verdict::untouched});
}

TEST_CASE("a doubt advises settings that a scene file has") {
  static const std::regex quoted("\"([a-z_]+)\"");
  const std::string schema = scene_schema();
  for (const Verdict verdict : kAll) {
    if (!doubt_of(verdict) || verdict == Verdict::untouched) continue;
    CAPTURE(verdict_name(verdict));
    const std::string text = doubt_of(verdict);
    std::size_t named = 0;
    for (std::sregex_iterator it(text.begin(), text.end(), quoted), end; it != end; ++it, ++named)
      CHECK_MESSAGE(schema.find("\"" + (*it)[1].str() + "\"") != std::string::npos, (*it)[1].str());
    CHECK(named >= 2);
  }
}
