#pragma once

#include <opencv2/core.hpp>

namespace palpate {

/// How much each pixel looks like an instrument, 8-bit, of the image's size: 128 = the edge. `probability` (0 to 1,
/// float, coarser than the image) says where instruments are; the picture says where they end: near the edge the answer
/// is linear in the colours of a neighbourhood (guided filter, He, Sun, Tang 2010, at a quarter of the size as in He,
/// Sun 2015).
cv::Mat follow_edges(const cv::Mat& bgr, const cv::Mat& probability);

}  // namespace palpate
