// SPDX-License-Identifier: Apache-2.0
#include "io/view/pick_request.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace h6::io::view {

using nlohmann::json;

Result<Picked> parse_picked(std::string_view text, std::size_t count) {
  const json all = json::parse(text, nullptr, false);
  if (!all.is_object() || !all.contains("do") || !all["do"].is_string())
    return Failure{"the page sent something that is no request"};
  if (all["do"] == "cancel") return Picked{};
  if (all["do"] != "use" || !all.contains("vertices") || !all["vertices"].is_array())
    return Failure{"the page asks for something that is not known here"};
  Picked picked;
  picked.use = true;
  for (const json& vertex : all["vertices"]) {
    if (!vertex.is_number_unsigned() || vertex.get<std::uint64_t>() >= count)
      return Failure{"the page names a vertex that the model does not have"};
    picked.vertices.push_back(vertex.get<std::uint32_t>());
  }
  if (picked.vertices.empty()) return Failure{"no vertex is chosen"};
  std::sort(picked.vertices.begin(), picked.vertices.end());
  picked.vertices.erase(std::unique(picked.vertices.begin(), picked.vertices.end()),
                        picked.vertices.end());
  return picked;
}

}  // namespace h6::io::view
