#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/refine.h"

namespace palpate {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();
constexpr int kMeasureRadius = 5;
constexpr float kNoiseSpread = 2.5f;  // of OpenCV's matchers against the rendered organs

cv::Mat warped_right(const PreparedPair& prepared, const cv::Mat& disparity, cv::Mat& weight) {
  cv::Mat map_x(disparity.size(), CV_32F), map_y(disparity.size(), CV_32F), right;
  for (int y = 0; y < disparity.rows; ++y)
    for (int x = 0; x < disparity.cols; ++x) {
      map_x.at<float>(y, x) = static_cast<float>(x) - disparity.at<float>(y, x);
      map_y.at<float>(y, x) = static_cast<float>(y);
    }
  cv::patchNaNs(map_x, -10);
  cv::remap(prepared.right, right, map_x, map_y, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::remap(prepared.right_mask, weight, map_x, map_y, cv::INTER_NEAREST, cv::BORDER_CONSTANT, cv::Scalar(0));
  weight &= prepared.left_mask;
  weight &= disparity == disparity;
  return right;
}

cv::Mat mean(const cv::Mat& values, const cv::Mat& weight_mean) {
  cv::Mat sum;
  const int size = 2 * kMeasureRadius + 1;
  cv::boxFilter(values, sum, CV_32F, {size, size});
  cv::divide(sum, weight_mean, sum);
  return sum;
}

}  // namespace

DisparityMap measure(const PreparedPair& prepared, const cv::Mat& disparity_px) {
  DisparityMap map;
  cv::Mat usable;
  const cv::Mat right = warped_right(prepared, disparity_px, usable);
  cv::Mat w, w_mean, slope;
  usable.convertTo(w, CV_32F, 1.0 / 255);
  cv::boxFilter(w, w_mean, CV_32F, {2 * kMeasureRadius + 1, 2 * kMeasureRadius + 1});
  w_mean += 1e-6f;
  cv::Sobel(prepared.left, slope, CV_32F, 1, 0, cv::FILTER_SCHARR, 1.0 / 32);
  const cv::Mat l = prepared.left.mul(w), r = right.mul(w), g = slope.mul(w);
  const cv::Mat ml = mean(l, w_mean), mr = mean(r, w_mean), mg = mean(g, w_mean);
  const cv::Mat ll = mean(l.mul(l), w_mean) - ml.mul(ml), rr = mean(r.mul(r), w_mean) - mr.mul(mr);
  const cv::Mat lr = mean(l.mul(r), w_mean) - ml.mul(mr), gg = mean(g.mul(g), w_mean) - mg.mul(mg);
  for (cv::Mat* m : {&map.disparity_px, &map.deviation_px, &map.correlation})
    *m = cv::Mat(disparity_px.size(), CV_32F, cv::Scalar(kNothing));
  const float pixels = (2 * kMeasureRadius + 1) * (2 * kMeasureRadius + 1);
  for (int y = 0; y < w.rows; ++y)
    for (int x = 0; x < w.cols; ++x) {
      const float a = ll.at<float>(y, x), b = rr.at<float>(y, x), c = gg.at<float>(y, x);
      if (!usable.at<uchar>(y, x) || a < 1e-2f || b < 1e-2f || c < 1e-3f) continue;
      const float correlation = lr.at<float>(y, x) / std::sqrt(a * b);
      const float residual = std::max(1e-3f, 2 * a * (1 - correlation));
      map.disparity_px.at<float>(y, x) = disparity_px.at<float>(y, x);
      map.correlation.at<float>(y, x) = correlation;
      const float information = c * pixels * w_mean.at<float>(y, x) / residual;
      map.deviation_px.at<float>(y, x) = deviation_px(information / (kNoiseSpread * kNoiseSpread));
    }
  return map;
}

}  // namespace palpate