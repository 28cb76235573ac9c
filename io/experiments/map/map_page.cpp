// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/map/map_page.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace h6::cli {
namespace {

// Pixels of the drawing.
constexpr double kNames = 240, kPanel = 250, kGap = 14, kRow = 15, kTop = 44, kBetween = 8;
constexpr double kLeast = 0.02, kMost = 20;  // depths at the edges of a panel [voxel]
constexpr const char* kPanelNames[kMapForces] = {"the force of half a voxel", "the scene's force",
                                                 "pushed 1.5 to 8 times as hard"};
constexpr const char* kStyle =
    "body{font:14px sans-serif;max-width:1080px;margin:2em auto;padding:0 1em;color:#222;"
    "background:#fff}table{border-collapse:collapse;font-size:12px}td,th{border:1px solid #ccc;"
    "padding:2px 6px;text-align:left}svg{font:11px sans-serif;max-width:100%}"
    "circle{fill:#2166ac;fill-opacity:.55}path{stroke:#c0392b;stroke-width:1.6;fill:none}"
    "line{stroke:#ddd}line.half{stroke:#888;stroke-dasharray:4 3}";

std::string html_text(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

template <class... Values>
std::string printed(const char* format, Values... values) {
  char out[400];
  std::snprintf(out, sizeof out, format, values...);
  return out;
}

double panel_left(int force) { return kNames + force * (kPanel + kGap); }

double place(int force, double depth) {
  const double part =
      std::log(std::clamp(depth, kLeast, kMost) / kLeast) / std::log(kMost / kLeast);
  return panel_left(force) + part * kPanel;
}

std::string words(double x, double y, const char* anchor, const std::string& text) {
  return printed("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor) +
         html_text(text) + "</text>\n";
}

// The marks of one scene and method; they stand a little above and below each other.
std::string marks(const MapScene& scene, int table, std::size_t method, const std::string& name,
                  double y) {
  std::string out;
  for (const MapVariation& v : scene.variations)
    for (int force = 0; v.error.empty() && force < kMapForces; ++force) {
      const MapRun& run = v.run(table, force, method);
      const double x = place(force, run.depth);
      const double at = y + 2.5 * (static_cast<double>(v.index % 3) - 1);
      out += run.held ? printed("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.2\">", x, at)
                      : printed("<path d=\"M%.1f %.1fl6 6m0 -6l-6 6\">", x - 3, at - 3);
      out += "<title>" +
             html_text(scene.name + ":" + std::to_string(v.index) + " " + name + ", " +
                       number(v.newtons[force], 1) + " N: " + io::verdict_name(run.verdict) + ", " +
                       number(run.depth, 2) + " voxels" + (run.error.empty() ? "" : ", ") +
                       run.error) +
             "</title>" + (run.held ? "</circle>\n" : "</path>\n");
    }
  return out;
}

// Panels, their names, and the axis of depths.
std::string frame(double bottom) {
  std::string out;
  for (int force = 0; force < kMapForces; ++force) {
    out += words(panel_left(force) + kPanel / 2, 14, "middle", kPanelNames[force]);
    for (const double depth : {0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0}) {
      const double x = place(force, depth);
      out += printed("<line%s x1=\"%.1f\" x2=\"%.1f\" y1=\"34\" y2=\"%.1f\"/>\n",
                     depth == 0.5 ? " class=\"half\"" : "", x, x, bottom);
      out += words(x, 30, "middle", number(depth, depth < 0.1 ? 2 : depth < 1 ? 1 : 0));
    }
  }
  return out;
}

std::string html_table(const TextTable& table) {
  std::string out = "<table>\n";
  for (std::size_t row = 0; row < table.size(); ++row) {
    out += "<tr>";
    const char* cell = row == 0 ? "th" : "td";
    for (const std::string& text : table[row])
      out += std::string("<") + cell + ">" + html_text(text) + "</" + cell + ">";
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

}  // namespace

std::string map_drawing(const MapReport& report, int table) {
  std::string rows;
  double y = kTop;
  for (const MapScene* scene : run_scenes(report.scenes)) {
    rows += words(0, y + 4, "start", scene->name);
    for (std::size_t m = 0; m < report.options.methods.size(); ++m, y += kRow) {
      const std::string& name = report.options.methods[m].name;
      rows += words(kNames - 10, y + 4, "end", name) + marks(*scene, table, m, name, y);
    }
    y += kBetween;
  }
  const double width = panel_left(kMapForces);
  return printed("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %.0f %.0f\">\n", width,
                 y) +
         frame(y - kBetween) + rows + "</svg>\n";
}

std::string map_page(const MapReport& report) {
  std::string out =
      "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
      "<title>Robustness map</title>\n<style>";
  out += std::string(kStyle) + "</style>\n<h1>Robustness map</h1>\n<p>" +
         html_text(MapReport::about()) +
         "</p>\n<p>In the drawings each mark is a run, at its deepest point in voxels: a dot is "
         "held, a cross is not. The dashed line is half a voxel. A mark names its run when the "
         "mouse rests on it.</p>\n";
  for (int table = 0; table < kMapTables; ++table)
    out += std::string("<h2>") +
           (table == kEqualStiffness ? "Equal stiffness k" : "Equal stiffness of a flat wall") +
           "</h2>\n" + map_drawing(report, table) + html_table(report.table(table));
  out += "<h2>Conclusions</h2>\n<ul>\n";
  for (const std::string& sentence : map_conclusions(report.scenes, report.options.methods))
    out += "<li>" + html_text(sentence) + "</li>\n";
  for (const MapScene& scene : report.scenes)
    if (!scene.left_out.empty())
      out += "<li>Left out: " + html_text(scene.name + ", " + scene.left_out) + ".</li>\n";
  return out + "</ul>\n</html>\n";
}

}  // namespace h6::cli
