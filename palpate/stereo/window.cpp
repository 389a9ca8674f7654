#include "palpate/stereo/window.h"

#include <opencv2/imgproc.hpp>

namespace palpate {

Level make_level(const cv::Mat& grey, const cv::Mat& mask) {
  constexpr int m = Level::kMargin_px;
  Level level;
  level.size = grey.size();
  cv::copyMakeBorder(grey, level.grey, m, m, m, m, cv::BORDER_REPLICATE);
  const cv::Matx13f central(-0.5f, 0, 0.5f);
  cv::filter2D(level.grey, level.gradient, CV_32F, central, {-1, -1}, 0, cv::BORDER_REPLICATE);
  cv::Mat weight;
  mask.convertTo(weight, CV_32F, 1.0 / 255);
  cv::copyMakeBorder(weight, level.weight, m, m, m, m, cv::BORDER_CONSTANT, cv::Scalar(0));
  return level;
}

}  // namespace palpate
