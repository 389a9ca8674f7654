#pragma once

#include "palpate/stereo/rig.h"
#include "palpate/surface/depth_edges.h"

namespace palpate {

/// Where the measured tissue has edges. `covered`: 255 = an instrument or a highlight hides it, rectified left image.
DepthEdges find_edges(const PointCloud& cloud, const Rectification& rectification, const cv::Mat& covered,
                      const EdgeOptions& options);

}  // namespace palpate
