#include "palpate/stereo/triangulate.h"

#include <cmath>

namespace palpate {

PointCloud triangulate(const DisparityMap& disparity, const Rectification& rectification, const cv::Mat& left_bgr) {
  PointCloud cloud;
  for (int y = 0; y < disparity.disparity_px.rows; ++y) {
    const float* d = disparity.disparity_px.ptr<float>(y);
    const float* deviation = disparity.deviation_px.ptr<float>(y);
    const float* correlation = disparity.correlation.ptr<float>(y);
    for (int x = 0; x < disparity.disparity_px.cols; ++x) {
      if (!(d[x] > 0)) continue;
      cloud.position_mm.push_back(triangulate_pixel(rectification, cv::Point2d(x, y), d[x]));
      cloud.depth_deviation_mm.push_back(static_cast<float>(rectification.depth_mm(d[x]) / d[x]) * deviation[x]);
      cloud.correlation.push_back(correlation[x]);
      cloud.colour.push_back(left_bgr.at<cv::Vec3b>(y, x));
    }
  }
  return cloud;
}

}  // namespace palpate
