#pragma once

#include "palpate/stereo/grow.h"
#include "palpate/stereo/match.h"

namespace palpate {

/// Disparity of every pixel between matched cells, from their planes; NaN elsewhere and outside the left mask.
cv::Mat fill_between_cells(const CellGrid& grid, const cv::Mat& left_mask);

/// Lucas-Kanade along the row for every pixel at once, starting from a dense disparity: each pixel's window is warped
/// by the disparities of all its pixels (so that slant and curvature do no harm), gain and offset are free, masked
/// pixels of either eye have no weight. Leaves disparity, correlation and the deviation that residual and gradient
/// energy imply.
DisparityMap refine(const Eyes& eyes, const cv::Mat& start_px, int radius_px, int iterations);

/// Correlation and deviation of a disparity found by other means.
DisparityMap measure(const Eyes& eyes, const cv::Mat& disparity_px);

}  // namespace palpate
