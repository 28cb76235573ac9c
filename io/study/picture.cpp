// SPDX-License-Identifier: Apache-2.0
#include "io/study/picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>

namespace h6::study {
namespace {

constexpr int kWide = 720, kLeft = 60, kHigh = 150, kPanel = 230, kTop = 56;
constexpr std::size_t kMostBars = 24;

// From good to bad; colours that differ in lightness, too.
struct Verdict {
  const char *name, *colour;
};
constexpr Verdict kVerdicts[] = {
    {"arrived", "#1b7837"}, {"held", "#5aae61"}, {"untouched", "#d9f0d3"}, {"unheld", "#c7c7c7"},
    {"stuck", "#fdb863"},   {"sunk", "#e08214"}, {"chatters", "#b2abd2"},  {"unstable", "#8073ac"},
    {"through", "#b2182b"}, {"error", "#333333"}};

struct Bar {
  std::string label;
  std::map<std::string, int> verdicts;
  std::vector<double> depths;
  int runs = 0;
};

std::optional<double> number_of(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != 0 || !std::isfinite(value)) return std::nullopt;
  return value;
}

// Numbers rise, words keep their order.
std::vector<std::string> values_of(std::size_t key, const std::vector<Seen>& rows) {
  std::vector<std::string> out;
  for (const Seen& row : rows)
    if (std::find(out.begin(), out.end(), row.values[key]) == out.end())
      if (out.push_back(row.values[key]); out.size() > 4 * kMostBars) break;
  return out;
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

void add(Bar& bar, const Seen& row) {
  ++bar.runs, ++bar.verdicts[row.verdict];
  if (std::isfinite(row.depth)) bar.depths.push_back(row.depth);
}

std::vector<Bar> bars_of(std::size_t key, const std::vector<Seen>& rows) {
  const std::vector<std::string> values = values_of(key, rows);
  const bool numbers = std::all_of(values.begin(), values.end(),
                                   [](const std::string& v) { return number_of(v).has_value(); });
  std::vector<Bar> bars;
  if (values.size() <= kMostBars) {
    std::vector<std::string> order = values;
    if (numbers)
      std::sort(order.begin(), order.end(), [](const std::string& a, const std::string& b) {
        return *number_of(a) < *number_of(b);
      });
    for (const std::string& value : order) {
      bars.push_back({numbers ? short_number(*number_of(value)) : value, {}, {}, 0});
      for (const Seen& row : rows)
        if (row.values[key] == value) add(bars.back(), row);
    }
    return bars;
  }
  if (!numbers) return bars;  // so many words are no axis
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const Seen& row : rows)
    if (const auto v = number_of(row.values[key]))
      low = std::min(low, *v), high = std::max(high, *v);
  const std::size_t count = kMostBars / 2;
  for (std::size_t i = 0; i < count; ++i)
    bars.push_back(
        {short_number(low + (high - low) * (static_cast<double>(i) + 0.5) / count), {}, {}, 0});
  for (const Seen& row : rows)
    if (const auto v = number_of(row.values[key])) {
      const auto at = static_cast<std::size_t>((*v - low) / (high - low) * count);
      add(bars[std::min(at, count - 1)], row);
    }
  return bars;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<'   ? "&lt;"
           : c == '>' ? "&gt;"
           : c == '&' ? "&amp;"
           : c == '"' ? "&quot;"
                      : std::string(1, c);
  return out;
}

struct Svg {
  std::string text;
  void rectangle(double x, double y, double w, double h, const char* colour,
                 const std::string& says) {
    char shape[160];
    std::snprintf(shape, sizeof shape,
                  "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\">", x, y,
                  w, h, colour);
    text += shape + ("<title>" + escaped(says) + "</title></rect>\n");
  }
  void word(double x, double y, const char* anchor, const std::string& says) {
    char shape[96];
    std::snprintf(shape, sizeof shape, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y,
                  anchor);
    text += shape + escaped(says) + "</text>\n";
  }
  void dot(double x, double y, const std::string& says) {
    char shape[128];
    std::snprintf(shape, sizeof shape,
                  "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"3.5\" fill=\"white\" stroke=\"black\">", x,
                  y);
    text += shape + ("<title>" + escaped(says) + "</title></circle>\n");
  }
};

void draw_panel(Svg& svg, double top, const std::string& key, const std::vector<Bar>& bars) {
  double deepest = 0;
  for (const Bar& bar : bars)
    if (!bar.depths.empty()) deepest = std::max(deepest, median(bar.depths));
  const double step = (kWide - 2.0 * kLeft) / static_cast<double>(bars.size());
  svg.word(kLeft, top - 8, "start", key);
  svg.word(kLeft - 6, top + 10, "end", "100 %");
  svg.word(kLeft - 6, top + kHigh, "end", "0");
  svg.word(kWide - kLeft + 6, top + 10, "start", short_number(deepest));
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const Bar& bar = bars[i];
    const double x = kLeft + step * static_cast<double>(i);
    double y = top + kHigh;
    for (const Verdict& verdict : kVerdicts) {
      const auto found = bar.verdicts.find(verdict.name);
      if (found == bar.verdicts.end()) continue;
      const double high = kHigh * static_cast<double>(found->second) / bar.runs;
      y -= high;
      svg.rectangle(x + 0.1 * step, y, 0.8 * step, high, verdict.colour,
                    key + " " + bar.label + ": " + verdict.name + " " +
                        std::to_string(found->second) + " of " + std::to_string(bar.runs));
    }
    if (!bar.depths.empty() && deepest > 0) {
      const double depth = median(bar.depths);
      svg.dot(x + 0.5 * step, top + kHigh * (1 - depth / deepest),
              "median depth " + short_number(depth) + " voxels");
    }
    svg.word(x + 0.5 * step, top + kHigh + 16, "middle", bar.label);
  }
}

}  // namespace

std::string picture(const std::string& title, const std::vector<std::string>& keys,
                    const std::vector<Seen>& rows) {
  Svg svg;
  svg.word(
      kLeft, 20, "start",
      title + ", " + std::to_string(rows.size()) + " runs; dots: median depth [voxel], right axis");
  double x = kLeft;
  for (const Verdict& verdict : kVerdicts) {
    if (std::none_of(rows.begin(), rows.end(),
                     [&](const Seen& r) { return r.verdict == verdict.name; }))
      continue;
    svg.rectangle(x, 30, 10, 10, verdict.colour, verdict.name);
    svg.word(x + 14, 39, "start", verdict.name);
    x += 30 + 7.0 * static_cast<double>(std::string(verdict.name).size());
  }
  double top = kTop + 20;
  for (std::size_t key = 0; key < keys.size(); ++key) {
    const std::vector<Bar> bars = bars_of(key, rows);
    if (bars.empty()) continue;
    draw_panel(svg, top, keys[key], bars);
    top += kPanel;
  }
  char head[200];
  std::snprintf(head, sizeof head,
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%.0f\" "
                "font-family=\"sans-serif\" "
                "font-size=\"11\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
                kWide, top);
  return head + svg.text + "</svg>\n";
}

}  // namespace h6::study
