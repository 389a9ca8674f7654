#include "palpate/stereo/window.h"

#include <opencv2/imgproc.hpp>

namespace palpate {

Level make_level(const cv::Mat& grey, const cv::Mat& mask) {
  constexpr int m = Level::kMargin_px;
  Level level;
  level.size = grey.size();
  cv::copyMakeBorder(grey, level.grey, m, m, m, m, cv::BORDER_REPLICATE);
  level.gradient.create(level.grey.size(), CV_32F);
  const int last = level.grey.cols - 1;
  for (int y = 0; y < level.grey.rows; ++y) {
    const float* l = level.grey.ptr<float>(y);
    float* g = level.gradient.ptr<float>(y);
    for (int x = 1; x < last; ++x) g[x] = 0.5f * (l[x + 1] - l[x - 1]);
    g[0] = g[last] = 0;
  }
  cv::Mat weight;
  mask.convertTo(weight, CV_32F, 1.0 / 255);
  cv::copyMakeBorder(weight, level.weight, m, m, m, m, cv::BORDER_CONSTANT, cv::Scalar(0));
  return level;
}

}  // namespace palpate
