#pragma once

#include "palpate/stereo/match.h"
#include "palpate/stereo/seeds.h"

namespace palpate {

/// Quasi-dense stereo (Stoyanov 2010; the paper's [16]): Lucas-Kanade seeds checked both ways, best-first region
/// growing by ZNCC with a disparity-gradient limit, sub-pixel refinement of every match, left-right check. The
/// disparity range [least_px, most_px] may be negative on purpose (to notice swapped cameras).
DisparityMap match_quasi_dense(const cv::Mat& left_bgr, const cv::Mat& right_bgr, const cv::Mat& mask,
                               double min_disparity_px, double max_disparity_px);

/// The same from seeds found before, on cameras whose rows are aligned (see align_rows).
DisparityMap match_quasi_dense(const PreparedPair& prepared, const Seeds& seeds, double min_disparity_px,
                               double max_disparity_px);

/// 255 where a pixel shows tissue that can be matched: inside the image, no specular highlight (saturated, colourless,
/// grown by its halo), not the black border of the scope.
cv::Mat matchable_mask(const cv::Mat& bgr);

}  // namespace palpate
