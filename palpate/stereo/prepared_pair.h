#pragma once

#include <opencv2/core.hpp>

namespace palpate {

/// Both images of a rectified pair made ready for matching: grey, the right one with the mean and the deviation of the
/// left one (a gain difference of 5 % already stops Lucas-Kanade), and where each shows tissue that can be matched.
struct PreparedPair {
  cv::Mat left;        ///< CV_32F, grey levels
  cv::Mat right;       ///< CV_32F, grey levels
  cv::Mat left_mask;   ///< 8-bit, 255 = shows what the right camera can see too
  cv::Mat right_mask;  ///< 8-bit, 255 = shows what the left camera can see too
  cv::Mat wanted;      ///< 8-bit, 255 = where in the left image a disparity is wanted: small highlights too
};

/// `mask` (8-bit) is where the left image is wanted.
PreparedPair prepare_pair(const cv::Mat& left_bgr, const cv::Mat& right_bgr, const cv::Mat& mask);

/// A right image moved up by `row_offset_px`.
cv::Mat rows_aligned(const cv::Mat& right, double row_offset_px);

/// The right image and its mask moved up by `row_offset_px`, so that its rows match those of the left one.
void align_rows(PreparedPair& prepared, double row_offset_px);

}  // namespace palpate
