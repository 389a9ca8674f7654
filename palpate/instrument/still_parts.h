#pragma once

#include <opencv2/core.hpp>

#include "palpate/instrument/find_tip.h"

namespace palpate {

/// What was taken for an instrument in the static frame: also shadows, dark organs, gauze.
class StillParts {
 public:
  StillParts() = default;
  /// `mask` is 255 where an instrument was found in the static frame; both of one size.
  StillParts(const cv::Mat& static_bgr, const cv::Mat& mask);

  /// The mask of an image of the same size without what still shows at about the same place in the same colours, in
  /// parts that do not have the shape of an instrument with it. `picture_area` is 255 inside the picture.
  cv::Mat left_out_of(const cv::Mat& mask, const cv::Mat& bgr, const cv::Mat& picture_area) const;

  /// 255 where an image of any size shows them as they were, at the size of the static frame; empty: there were none.
  cv::Mat in(const cv::Mat& bgr) const;

 private:
  cv::Mat darkest_, brightest_;  ///< of the colours nearby, by channel; empty: nothing is still
  cv::Mat nearby_;               ///< 255 where there are any
};

/// Whether the end of an instrument, in an image of this size, shows as in the static frame; `still` as of
/// `StillParts::in`, never where it is empty. At rest since then, it exerts no force that could be told, and may be no
/// instrument.
bool rests(const ImageInstrument& instrument, cv::Size image, const cv::Mat& still);

}  // namespace palpate
