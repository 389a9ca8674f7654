#pragma once

#include <opencv2/core.hpp>

namespace palpate {

/// The even rows, and between them the mean of the two that they lie between. 8-bit BGR.
cv::Mat deinterlaced(const cv::Mat& image);

}  // namespace palpate
