// SPDX-License-Identifier: Apache-2.0
// report.h - the experiments' tables as text for a terminal, as Markdown and as JSON.
#pragma once
#include <nlohmann/json.hpp>

#include "io/experiments/scenes.h"

namespace h6::cli {

// Rows of cells; the first row is the head.
using TextTable = std::vector<std::vector<std::string>>;
std::string plain(const TextTable& table);
std::string markdown(const TextTable& table);

// One study: what it measures and how, its table, and the same figures as JSON.
struct Study {
  std::string name, title, about;
  TextTable table;
  std::string after;    // the conclusion, below the table; may be empty
  std::string picture;  // SVG, a file of its own beside the report; may be empty
  nlohmann::ordered_json json;
};

TextTable scene_table(const std::vector<SceneRow>& rows, const std::vector<MethodColumn>& columns);
nlohmann::ordered_json to_json(const SceneRow& row, const std::vector<MethodColumn>& columns);
std::string markdown_report(const std::vector<SceneRow>& rows,
                            const std::vector<MethodColumn>& columns,
                            const std::vector<Study>& studies, double seconds);

}  // namespace h6::cli
