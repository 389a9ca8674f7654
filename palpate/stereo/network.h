#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

namespace palpate {

/// Disparity of the left image (CV_32F, px, left x minus right x) by a learned network, NaN where the same network does
/// not find it again from the right image. The file is ONNX with two inputs named `left` and `right`, each 1 x 3 x
/// height x width, float, RGB from 0 to 1, and one output, the disparity of the left image in px, of the same height
/// and width. Throws BadInput: the file cannot be read, other inputs, other outputs, an output of another size, or a
/// disparity that is not a number.
cv::Mat disparity_by_network(const cv::Mat& left_bgr, const cv::Mat& right_bgr, const std::filesystem::path& onnx);

}  // namespace palpate
