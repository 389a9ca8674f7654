#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

namespace palpate {

/// 8-bit BGR as JPEG; `width_px` 0 = as it is.
std::string jpeg_of(const cv::Mat& bgr, int width_px = 0, int quality = 85);
std::string png_of(const cv::Mat& bgr);
/// The first picture of a video or image. Throws BadInput.
cv::Mat first_picture(const std::filesystem::path& file);

}  // namespace palpate
