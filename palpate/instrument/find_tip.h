#pragma once

#include <optional>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

/// An instrument in one image: the axis of its shaft and the far end of its jaws.
struct ImageTip {
  cv::Point2d tip_px;
  cv::Point2d axis;     ///< unit vector from the shaft towards the tip
  double width_px = 0;  ///< of the shaft near the tip
};

/// One of the instruments in a mask.
struct ImageInstrument {
  ImageTip tip;
  cv::Rect box;  ///< of the whole image
  cv::Mat mask;  ///< 255 = this instrument, of the box
};

/// The instruments of a mask, each a part of it that hangs together, enters from the border of the picture at one place
/// (or begins near it: a dark shaft may not be seen) and looks like a shaft with a free end; the largest first. Two
/// that touch each other enter at two places and are none. `picture_area` (255 inside, may be empty) says where the
/// picture ends when it does not fill the image.
std::vector<ImageInstrument> find_instruments(const cv::Mat& instrument_mask, const cv::Mat& picture_area = {},
                                              size_t max = 4);

/// The tip of the largest instrument in the mask, if there is any.
std::optional<ImageTip> find_tip(const cv::Mat& instrument_mask, const cv::Mat& picture_area = {});

}  // namespace palpate
