// SPDX-License-Identifier: Apache-2.0
// picture.h - a finished table as one SVG: for each key that varies, the verdicts and the depth
// over its values.
#pragma once
#include <string>
#include <vector>

namespace h6::study {

// A row of a table as the picture sees it.
struct Seen {
  std::vector<std::string> values;  // one for each key, as in the table
  std::string verdict;
  double depth = 0;  // the deepest point [voxel]; NaN: there is none
};

// A panel a key, with at most 24 values each (of more, neighbours share a bar). Bars: the share of
// runs with each verdict; dots: the median depth.
std::string picture(const std::string& title, const std::vector<std::string>& keys,
                    const std::vector<Seen>& rows);

}  // namespace h6::study
