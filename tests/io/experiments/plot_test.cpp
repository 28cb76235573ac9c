// SPDX-License-Identifier: Apache-2.0
// plot_test.cpp - curves as SVG.
#include "io/experiments/plot.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <string>

using namespace h6::cli;

namespace {

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t n = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
  return n;
}

Panel panel_of(double height, std::size_t points) {
  Panel panel;
  panel.title = "depth";
  panel.curves = {{"firm", {}, {}}, {"global", {}, {}}};
  for (std::size_t i = 0; i < points; ++i)
    for (Curve& c : panel.curves) c.t.push_back(1e-3 * double(i)), c.y.push_back(0);
  panel.curves[0].y[points / 2] = height;  // one frame
  return panel;
}

}  // namespace

TEST_CASE("a peak of one frame among ten thousand reaches the top of its panel") {
  const std::string flat = plot_svg("a", {panel_of(0, 10000)});
  const std::string peak = plot_svg("a", {panel_of(3, 10000)});
  CHECK(count(peak, "62.0") > count(flat, "62.0"));  // the top of the first panel
  CHECK(peak.size() < 60000);                        // a point a pixel, not a point a frame
}

TEST_CASE("every curve has its name once and its path in every panel; the limit is dashed") {
  Panel panel = panel_of(1, 100);
  const std::string without = plot_svg("t", {panel, panel, panel});
  CHECK(count(without, ">firm<") == 1);
  CHECK(count(without, "fill=\"none\"") == 2 * 3);
  CHECK(count(without, "dasharray") == 0);
  panel.line = 0.5;
  const std::string svg = plot_svg("t", {panel});
  CHECK(count(svg, "dasharray") == 1);
  CHECK(svg.rfind("<svg", 0) == 0);
  CHECK(count(svg, "<text") == count(svg, "</text>"));
}
