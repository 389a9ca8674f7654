#pragma once

#include "palpate/stereo/match.h"

namespace palpate {

/// One point per matched pixel, in the left camera frame, with its depth deviation z^2 / (f b) * sigma_d.
PointCloud triangulate(const DisparityMap& disparity, const Rectification& rectification, const cv::Mat& left_bgr);

}  // namespace palpate
