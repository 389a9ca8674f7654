#pragma once

#include <optional>

#include "palpate/core/geometry.h"

namespace palpate {

/// An instrument in one image: the axis of its shaft and the far end of its jaws.
struct ImageTip {
  cv::Point2d tip_px;
  cv::Point2d axis;     ///< unit vector from the shaft towards the tip
  double width_px = 0;  ///< of the shaft near the tip
};

/// Far end, along the shaft's axis, of the largest instrument in the mask; nothing when there is none or when it does
/// not enter from the border of the image (an instrument always does). `picture_area` (255 inside, may be empty) says
/// where the picture ends when it does not fill the image.
std::optional<ImageTip> find_tip(const cv::Mat& instrument_mask, const cv::Mat& picture_area = {});

}  // namespace palpate
