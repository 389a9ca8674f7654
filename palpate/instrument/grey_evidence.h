#pragma once

#include <opencv2/core.hpp>

namespace palpate {

/// Probability of an instrument (float, of the image's size) where a network says `probability` and may be mistaken:
/// metal and plastic are less red than most of the picture, so that what is grey is an instrument rather than what is
/// not. Redness as in metalness (segment.h), against that which 70 % of the picture exceed.
cv::Mat grey_counted_in(const cv::Mat& bgr, const cv::Mat& probability);

}  // namespace palpate
