#pragma once

#include "palpate/estimate/tissue_map.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// preview.png of a map, 8-bit BGR: the left image as recorded with the visible side of the mesh and the fixed nodes,
/// the depth and its deviation in mm over the rectified left image, and the mesh from the side.
cv::Mat draw_map_preview(const cv::Mat& left_bgr, const Rectification& rectification, const TissueMap& map);

}  // namespace palpate
