// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace h6::cli {
namespace {

constexpr double kWide = 860, kPlotLeft = 64, kPlotRight = 16, kPlotTop = 62, kPanel = 118,
                 kPanelGap = 30;
constexpr const char* kColours[] = {"#1f6fb4", "#d0342c", "#2f9e44", "#e0862f",
                                    "#7b4fb5", "#5f6b73", "#c2477f"};

std::string svg_line(const char* text, auto... values) {
  char buffer[400];
  std::snprintf(buffer, sizeof buffer, text, values...);
  return buffer;
}

std::string svg_text(double x, double y, const char* style, const std::string& text) {
  return svg_line("<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, style) + text + "</text>\n";
}

// The greatest value of each pixel.
std::string curve_path(const Curve& curve, double end, double top, double most,
                       const char* colour) {
  const double width = kWide - kPlotLeft - kPlotRight;
  std::string d;
  for (std::size_t i = 0; i < curve.t.size();) {
    const double pixel = std::floor(curve.t[i] / end * width);
    double y = 0;
    for (; i < curve.t.size() && std::floor(curve.t[i] / end * width) == pixel; ++i)
      y = std::max(y, curve.y[i]);
    d += svg_line("%c%.0f %.1f", d.empty() ? 'M' : 'L', kPlotLeft + pixel,
                  top + kPanel * (1 - std::min(1.0, y / most)));
  }
  return "<path d=\"" + d +
         svg_line("\" fill=\"none\" stroke=\"%s\" stroke-width=\"1.2\"/>\n", colour);
}

double greatest(const Panel& panel) {
  double most = panel.line;
  for (const Curve& c : panel.curves)
    for (const double y : c.y) most = std::max(most, y);
  return most > 0 ? most : 1;
}

std::string panel_svg(const Panel& panel, double top, double end) {
  const double most = panel.most > 0 ? panel.most : greatest(panel);
  const double right = kWide - kPlotRight;
  std::string out =
      svg_text(kPlotLeft, top - 6, "font-size=\"11\" font-weight=\"bold\"", panel.title);
  for (int i = 0; i <= 2; ++i) {
    const double y = top + kPanel * (1 - 0.5 * i);
    out += svg_line("<path d=\"M%.0f %.1fH%.0f\" stroke=\"#ddd\"/>\n", kPlotLeft, y, right);
    out += svg_text(kPlotLeft - 6, y + 4, "font-size=\"10\" text-anchor=\"end\" fill=\"#444\"",
                    svg_line("%.3g", 0.5 * i * most));
  }
  std::size_t colour = 0;
  for (const Curve& curve : panel.curves)
    out += curve_path(curve, end, top, most, kColours[colour++ % std::size(kColours)]);
  if (panel.line > 0)
    out += svg_line("<path d=\"M%.0f %.1fH%.0f\" stroke=\"#000\" stroke-dasharray=\"5 4\"/>\n",
                    kPlotLeft, top + kPanel * (1 - panel.line / most), right);
  return out;
}

}  // namespace

std::string plot_svg(const std::string& title, const std::vector<Panel>& panels) {
  double end = 1e-9;
  for (const Panel& panel : panels)
    for (const Curve& c : panel.curves)
      if (!c.t.empty()) end = std::max(end, c.t.back());
  const double high = kPlotTop + double(panels.size()) * (kPanel + kPanelGap) + 14;
  std::string out = svg_line(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
      "font-family=\"DejaVu Sans, sans-serif\">\n"
      "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
      kWide, high);
  out += svg_text(16, 20, "font-size=\"14\" font-weight=\"bold\"", title);
  double x = kPlotLeft;
  for (std::size_t i = 0; !panels.empty() && i < panels[0].curves.size(); ++i) {
    const char* colour = kColours[i % std::size(kColours)];
    out +=
        svg_line("<rect x=\"%.0f\" y=\"30\" width=\"12\" height=\"4\" fill=\"%s\"/>\n", x, colour);
    out += svg_text(x + 16, 36, "font-size=\"11\"", panels[0].curves[i].name);
    x += 34 + 7.5 * double(panels[0].curves[i].name.size());
  }
  double top = kPlotTop;
  for (const Panel& panel : panels) {
    out += panel_svg(panel, top, end);
    top += kPanel + kPanelGap;
  }
  for (int i = 0; i <= 4; ++i)
    out += svg_text(kPlotLeft + 0.25 * i * (kWide - kPlotLeft - kPlotRight), top - kPanelGap + 16,
                    "font-size=\"10\" text-anchor=\"middle\" fill=\"#444\"",
                    svg_line("%.2g s", 0.25 * i * end));
  return out + "</svg>\n";
}

}  // namespace h6::cli
