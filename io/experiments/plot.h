// SPDX-License-Identifier: Apache-2.0
// plot.h - curves over time as an SVG: panels one above the other with a common time axis.
#pragma once
#include <string>
#include <vector>

namespace h6::cli {

struct Curve {
  std::string name;
  std::vector<double> t, y;  // t rises [s]
};
struct Panel {
  std::string title;  // with its unit
  std::vector<Curve> curves;
  double line = 0;  // a dashed line at this height; 0: none
  double most = 0;  // top of the axis; 0: the greatest value
};

// Where a curve has more points than pixels, each pixel shows the greatest of its values. A curve
// has the same colour in every panel; the first panel's names make the legend.
std::string plot_svg(const std::string& title, const std::vector<Panel>& panels);

}  // namespace h6::cli
