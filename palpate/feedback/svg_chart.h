#pragma once

#include <string>
#include <vector>

namespace palpate {

/// One curve over time; a value that is not finite is a gap.
struct ChartSeries {
  std::string name;
  std::string css_class;
  std::vector<double> time_s;
  std::vector<double> value;
};

/// A stretch of time in a lane under the curves.
struct ChartSpan {
  double from_s = 0;
  double to_s = 0;
  std::string css_class;
};

struct ChartLane {
  std::string name;
  std::vector<ChartSpan> spans;
};

struct Chart {
  std::string value_title;  ///< with unit
  bool from_zero = false;   ///< the axis of values begins at 0
  std::vector<ChartSeries> series;
  std::vector<ChartLane> lanes;
};

/// The chart as an inline SVG element with axes, ticks and units, drawn for a page `width_px` wide. The element carries
/// the ends of its time axis (data-from-s, data-to-s, data-left, data-right) for a script that reads values out.
std::string svg_chart(const Chart& chart, int width_px, int height_px);

}  // namespace palpate
