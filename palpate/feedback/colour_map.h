#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>

namespace palpate {

/// viridis: perceptually ordered, readable without red-green vision, stands out on red tissue; jet: the paper's look.
enum class ColourMap { viridis, jet };

/// 256 colours (BGR) from the lowest to the highest value.
using ColourTable = std::array<cv::Vec3b, 256>;
ColourTable colour_table(ColourMap map);

/// Colour at a fraction of the scale; clamped to 0..1.
cv::Vec3b colour_at(const ColourTable& table, double fraction);

/// What a colour bar says.
struct ColourBar {
  double min = 0;
  double max = 1;
  std::string title;   ///< above the bar, with unit
  std::string note{};  ///< below the bar, may be empty
};

/// Vertical colour bar on a dark veil in `area` of a BGR image: title above, ticks with round numbers at its right.
/// `scale` is the size of text and lines, 1 for 960 x 540.
void draw_colour_bar(cv::Mat& image, const cv::Rect& area, const ColourTable& table, const ColourBar& bar,
                     double scale);

}  // namespace palpate
