// SPDX-License-Identifier: Apache-2.0
#include "bench/peers/picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace h6::peers {
namespace {

constexpr double kLeft = 190, kRight = 40, kWide = 900, kTop = 78, kRow = 30, kHead = 42;
constexpr double kLeast = 1, kMost = 1e6;  // [us]

double x_of(double us) {
  const double share =
      std::log10(std::clamp(us, kLeast, kMost) / kLeast) / std::log10(kMost / kLeast);
  return kLeft + (kWide - kLeft - kRight) * share;
}

std::string format(const char* text, auto... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, text, values...);
  return buffer;
}

std::string text_at(double x, double y, const char* style, const std::string& text) {
  return format("<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, style) + text + "</text>\n";
}

std::string duration(double us) {
  if (us < 10) return format("%.1f µs", us);
  if (us < 1000) return format("%.0f µs", us);
  return us < 10000 ? format("%.1f ms", us / 1000) : format("%.0f ms", us / 1000);
}

// A bar to the median, a line on to the 99th percentile.
std::string bar(double y, const Quantiles& t, const char* colour) {
  const double x0 = x_of(kLeast), x = x_of(t.p50), end = x_of(t.p99);
  return format("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"9\" fill=\"%s\"/>\n", x0, y,
                x - x0, colour) +
         format("<path d=\"M%.1f %.1fH%.1f\" stroke=\"%s\" stroke-width=\"1.5\"/>\n", x, y + 4.5,
                end, colour) +
         text_at(end + 5, y + 8.5, "font-size=\"10\" fill=\"#444\"", duration(t.p50));
}

}  // namespace

std::string svg_of(const std::vector<TaskReport>& tasks) {
  double high = kTop;
  for (const TaskReport& task : tasks) high += kHead + kRow * double(task.rows.size());
  high += 16;
  std::string out = format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
      "font-family=\"DejaVu Sans, sans-serif\">\n<rect width=\"100%%\" height=\"100%%\" "
      "fill=\"white\"/>\n",
      kWide, high);
  out += text_at(16, 26, "font-size=\"16\" font-weight=\"bold\"",
                 "All contacts of one pose: time on one thread");
  out += format("<rect x=\"16\" y=\"38\" width=\"12\" height=\"9\" fill=\"#1f6fb4\"/>");
  out += text_at(33, 47, "font-size=\"11\"", "poses in path order");
  out += format("<rect x=\"170\" y=\"38\" width=\"12\" height=\"9\" fill=\"#e0862f\"/>");
  out += text_at(187, 47, "font-size=\"11\"", "poses in random order");
  out += text_at(340, 47, "font-size=\"11\" fill=\"#444\"", "bar: median; line: 99th percentile");
  for (double us = kLeast; us <= kMost; us *= 10) {
    out += format("<path d=\"M%.1f %.1fV%.1f\" stroke=\"#ddd\"/>\n", x_of(us), kTop - 8, high - 12);
    out += text_at(x_of(us), kTop - 12, "font-size=\"10\" fill=\"#444\" text-anchor=\"middle\"",
                   us < 1000 ? format("%.0f µs", us) : format("%.0f ms", us / 1000));
  }
  double y = kTop;
  for (const TaskReport& task : tasks) {
    out += text_at(16, y + 24, "font-size=\"12\" font-weight=\"bold\"",
                   task.name + ": " + task.about +
                       format(", %zu and %zu triangles, %zu points", task.part_triangles,
                              task.obstacle_triangles, task.points));
    y += kHead;
    for (const Row& row : task.rows) {
      out += text_at(kLeft - 8, y + 13, "font-size=\"11\" text-anchor=\"end\"", row.peer);
      out += bar(y, row.path, "#1f6fb4") + bar(y + 11, row.shuffled, "#e0862f");
      y += kRow;
    }
  }
  return out + "</svg>\n";
}

}  // namespace h6::peers
