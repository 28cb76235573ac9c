// SPDX-License-Identifier: Apache-2.0
#include "io/experiments/report.h"

#include <algorithm>

namespace h6::cli {
namespace {

// The width in characters: UTF-8 continuation bytes do not count.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string prototype_cell(const TableScene& scene, const std::string& column) {
  const auto found = scene.prototype.find(column);
  return found == scene.prototype.end() ? "–" : found->second;
}

// The verdict in a cell is the word before the figure.
std::string verdict_word(const std::string& cell) { return cell.substr(0, cell.find(' ')); }

// Columns in which the engine's verdict differs from the prototype's.
std::vector<std::string> flips(const SceneRow& row, const std::vector<MethodColumn>& columns) {
  std::vector<std::string> out;
  for (std::size_t m = 0; m < columns.size(); ++m) {
    const auto found = row.scene->prototype.find(columns[m].name);
    if (found == row.scene->prototype.end()) continue;
    const std::string here = cell(row.runs[m]);
    if (verdict_word(here) != verdict_word(found->second))
      out.push_back("`" + columns[m].name + "` (" + here + ", prototype: " + found->second + ")");
  }
  return out;
}

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& w : words) out += (out.empty() ? "" : ", ") + w;
  return out;
}

std::string scene_section(const SceneRow& row, const std::vector<MethodColumn>& columns) {
  const TableScene& scene = *row.scene;
  std::string out = std::string("### ") + scene.name + " (" + scene.figure + ")\n\n";
  out += std::string("The paper: ") + scene.claim + "\n\n";
  TextTable table{{"method", "engine", "prototype", "contacts (most, mean)",
                   "largest force jump [N]", "late speed [mm/s]", "late depth swing [voxel]",
                   "frame p50, p99 [µs]", "recording"}};
  for (std::size_t m = 0; m < columns.size(); ++m) {
    const RunFigures& r = row.runs[m];
    table.push_back({columns[m].name, cell(r), prototype_cell(scene, columns[m].name),
                     std::to_string(r.contacts_max) + ", " + number(r.touching_contacts_mean, 0),
                     number(r.force_jump, 2), number(1e3 * r.late_speed, 2),
                     number(r.late_depth_swing, 3),
                     number(r.frame_us_p50, 0) + ", " + number(r.frame_us_p99, 0),
                     row.recordings[m].empty() ? "–" : row.recordings[m]});
  }
  out += markdown(table) + "\n";
  const std::vector<std::string> flipped = flips(row, columns);
  if (!scene.prototype.empty())
    out += flipped.empty() ? "Every verdict is the prototype's.\n\n"
                           : "Verdicts other than the prototype's: " + joined(flipped) + ".\n\n";
  if (*scene.difference) out += std::string(scene.difference) + "\n\n";
  for (std::size_t m = 0; m < columns.size(); ++m)
    if (!row.runs[m].error.empty())
      out += "`" + columns[m].name + "` could not be run: " + row.runs[m].error + "\n\n";
  return out;
}

}  // namespace

std::string plain(const TextTable& table) {
  std::vector<std::size_t> widths;
  for (const auto& row : table)
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (widths.size() <= i) widths.push_back(0);
      widths[i] = std::max(widths[i], width_of(row[i]));
    }
  std::string out;
  for (const auto& row : table) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i)
      line += row[i] + std::string(widths[i] - width_of(row[i]) + 2, ' ');
    while (!line.empty() && line.back() == ' ') line.pop_back();
    out += line + "\n";
  }
  return out;
}

std::string markdown(const TextTable& table) {
  std::string out;
  for (std::size_t r = 0; r < table.size(); ++r) {
    out += "|";
    for (const std::string& text : table[r]) out += " " + text + " |";
    out += "\n";
    if (r > 0) continue;
    out += "|";
    for (std::size_t i = 0; i < table[0].size(); ++i) out += "---|";
    out += "\n";
  }
  return out;
}

TextTable scene_table(const std::vector<SceneRow>& rows, const std::vector<MethodColumn>& columns) {
  TextTable table(1, {"scene"});
  for (const MethodColumn& c : columns) table[0].push_back(c.name);
  for (const SceneRow& row : rows) {
    table.push_back({row.scene->name});
    for (const RunFigures& run : row.runs) table.back().push_back(cell(run));
  }
  return table;
}

nlohmann::ordered_json to_json(const SceneRow& row, const std::vector<MethodColumn>& columns) {
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  for (std::size_t m = 0; m < columns.size(); ++m) {
    const RunFigures& r = row.runs[m];
    nlohmann::ordered_json run{{"verdict", io::verdict_name(r.verdict)},
                               {"max_depth_voxels", r.max_depth_voxels},
                               {"final_depth_voxels", r.final_depth_voxels},
                               {"contacts_max", r.contacts_max},
                               {"contacts_mean", r.touching_contacts_mean},
                               {"force_jump", r.force_jump},
                               {"late_speed", r.late_speed},
                               {"late_depth_swing_voxels", r.late_depth_swing},
                               {"frame_us", {{"p50", r.frame_us_p50}, {"p99", r.frame_us_p99}}},
                               {"status_bits", r.status}};
    if (!row.recordings[m].empty()) run["recording"] = row.recordings[m];
    if (!r.error.empty()) run["error"] = r.error;
    const auto known = row.scene->prototype.find(columns[m].name);
    if (known != row.scene->prototype.end()) run["prototype"] = known->second;
    out[columns[m].name] = std::move(run);
  }
  return out;
}

std::string markdown_report(const std::vector<SceneRow>& rows,
                            const std::vector<MethodColumn>& columns,
                            const std::vector<Study>& studies, double seconds) {
  std::string out =
      "# The paper's experiments, measured with the engine\n\n"
      "Made by `hapsix experiments -o DIR` in " +
      number(seconds, 0) +
      " s. Run it again for the frame times of your own machine; everything else is the same to"
      " the bit on a processor with the same vector instructions. With others (AVX-512, AVX2) the "
      "last bits of forces differ, and with them the last figures of some pushes, bounces and "
      "limits of stability. H. Xu, J. Barbič, *Adaptive 6-DoF Haptic Contact Stiffness Using the "
      "Gauss Map*, IEEE Trans. Haptics, 2016, is \"the paper\". \"The prototype\" is a throw-away "
      "program with analytic distance functions; its coupling damped outside its bound and its "
      "contacts could pull. Its verdicts are expected here, its figures only roughly.\n\n";
  if (!rows.empty()) {
    out +=
        "## Scenes\n\n"
        "Each cell gives the verdict, which does not know the method, and the deepest contact in "
        "voxels. `through` is \"slides in\", \"pops\" or \"squeezes through\". "
        "`global/1` is global scaling with n0 = 1. Common values: voxel 1 mm, m = 0.1 kg, h = 1 "
        "ms, k = 1e4 N/m, k_VC = 1e3 N/m critically damped, bound at half a voxel (5 N), 0.9 "
        "N·m/rad, contact damping 1 ms, implicit, unless the scene says otherwise.\n\n" +
        markdown(scene_table(rows, columns)) + "\n";
    for (const SceneRow& row : rows) out += scene_section(row, columns);
  }
  if (!studies.empty()) out += "## Studies\n\n";
  for (const Study& study : studies) {
    out += "### " + study.title + "\n\n" + study.about + "\n\n" + markdown(study.table) + "\n";
    if (!study.picture.empty()) out += "![" + study.title + "](" + study.name + ".svg)\n\n";
    if (!study.after.empty()) out += study.after + "\n\n";
  }
  return out;
}

}  // namespace h6::cli
