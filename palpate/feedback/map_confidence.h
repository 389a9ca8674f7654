#pragma once

#include "palpate/estimate/tissue_map.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// What of the map to believe: the rectified left image, on the organ the deviation of the depth in mm where it was
/// measured, hatched where its surface only continues what surrounds it, other pieces in blue, and every rim.
cv::Mat draw_map_confidence(const cv::Mat& left_bgr, const Rectification& rectification, const TissueMap& map);

/// Corners of the longest rim of a surface in the left image as recorded, without those within a pixel of the line.
std::vector<cv::Point2d> outline_px(const Surface& surface, const StereoRig& rig);

}  // namespace palpate
