#include "palpate/observe/picture_quality.h"

#include <opencv2/imgproc.hpp>
#include <utility>

namespace palpate {

namespace {

/// Standard deviation of what is finer than a few pixels, grey levels.
double contrast_of(const cv::Mat& bgr) {
  cv::Mat half, grey, smooth, fine;
  cv::resize(bgr, half, {}, 0.5, 0.5, cv::INTER_AREA);
  cv::cvtColor(half, grey, cv::COLOR_BGR2GRAY);
  cv::GaussianBlur(grey, smooth, {}, 3);
  cv::subtract(grey, smooth, fine, {}, CV_16S);
  cv::Scalar mean, deviation;
  cv::meanStdDev(fine, mean, deviation);
  return deviation[0];
}

cv::Mat every_fourth_pixel(const cv::Mat& picture) {
  cv::Mat part;
  if (!picture.empty()) cv::resize(picture, part, {}, 0.25, 0.25, cv::INTER_NEAREST);
  return part;
}

bool is_same(const cv::Mat& a, const cv::Mat& b, double min_noise_levels) {
  if (a.empty() || a.size() != b.size()) return false;
  return cv::norm(a, b, cv::NORM_L1) < min_noise_levels * 3 * static_cast<double>(a.total());
}

}  // namespace

PictureWatch::PictureWatch(const cv::Mat& map_left_bgr, const PictureQualityParameters& parameters)
    : parameters_(parameters), map_contrast_(contrast_of(map_left_bgr)) {}

PictureQuality PictureWatch::update(const cv::Mat& left_bgr, const cv::Mat& right_bgr) {
  const std::array<cv::Mat, 2> before =
      std::exchange(last_, {every_fourth_pixel(left_bgr), every_fourth_pixel(right_bgr)});
  PictureQuality quality;
  quality.repeated = is_same(before[0], last_[0], parameters_.min_noise_levels) &&
                     is_same(before[1], last_[1], parameters_.min_noise_levels);
  quality.obscured = contrast_of(left_bgr) < parameters_.obscured_contrast * map_contrast_;
  return quality;
}

}  // namespace palpate
