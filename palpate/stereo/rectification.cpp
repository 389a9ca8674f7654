#include <Eigen/Core>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/rig.h"

namespace palpate {
namespace {

bool has_no_distortion(const Camera& camera) {
  for (const double coefficient : camera.distortion)
    if (coefficient != 0) return false;
  return camera.lens == LensModel::brown;
}

// Nothing to do when the pixels would move by less than a hundred-thousandth.
bool already_rectified(const StereoRig& rig) {
  constexpr double kTiny = 1e-8;
  const cv::Matx33d& K = rig.left.K;
  return has_no_distortion(rig.left) && has_no_distortion(rig.right) && cv::norm(K - rig.right.K) < 1e-6 &&
         std::abs(K(0, 0) - K(1, 1)) < 1e-6 && K(0, 1) == 0 && rig.right_from_left.isIdentity(kTiny) &&
         rig.right_from_left_mm.tail<2>().norm() < kTiny * rig.baseline_mm();
}

cv::Mat valid_pixels(const cv::Mat& map_x, const cv::Mat& map_y, cv::Size size) {
  cv::Mat valid(size, CV_8U);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const float u = map_x.at<float>(y, x), v = map_y.at<float>(y, x);
      const bool inside =
          u >= 0 && v >= 0 && u <= static_cast<float>(size.width - 1) && v <= static_cast<float>(size.height - 1);
      valid.at<uchar>(y, x) = inside ? 255 : 0;
    }
  return valid;
}

void make_maps(const Camera& camera, const cv::Mat& turn, const cv::Mat& projection, cv::Size size, cv::Mat& map_x,
               cv::Mat& map_y) {
  if (camera.lens == LensModel::fisheye)
    cv::fisheye::initUndistortRectifyMap(camera.K, camera.distortion, turn, projection, size, CV_32F, map_x, map_y);
  else
    cv::initUndistortRectifyMap(camera.K, camera.distortion, turn, projection, size, CV_32F, map_x, map_y);
}

}  // namespace

Rectification make_rectification(const StereoRig& rig, cv::Size video_size) {
  check_rig_fits(rig, video_size);
  Rectification result;
  result.rig = rig;
  result.size = video_size;
  result.baseline_mm = rig.baseline_mm();
  if (already_rectified(rig)) {
    result.identity = true;
    result.focal_px = rig.left.K(0, 0);
    result.principal_x_px = rig.left.K(0, 2);
    result.principal_y_px = rig.left.K(1, 2);
    result.valid_left = cv::Mat(video_size, CV_8U, cv::Scalar(255));
    result.valid_right = result.valid_left;
    return result;
  }
  cv::Mat R, R1, R2, P1, P2, Q;
  cv::eigen2cv(rig.right_from_left, R);
  const cv::Vec3d T(rig.right_from_left_mm.x(), rig.right_from_left_mm.y(), rig.right_from_left_mm.z());
  // alpha = -1 keeps the resolution of the recording; what the shifted images lack is left to the validity masks. The
  // distortion only moves the middle; that of a fisheye lens is not what this function expects.
  const auto brown = [](const Camera& camera) {
    return camera.lens == LensModel::brown ? camera.distortion : std::vector<double>{};
  };
  cv::stereoRectify(rig.left.K, brown(rig.left), rig.right.K, brown(rig.right), video_size, R, T, R1, R2, P1, P2, Q,
                    cv::CALIB_ZERO_DISPARITY, -1, video_size);
  make_maps(rig.left, R1, P1, video_size, result.left_map_x, result.left_map_y);
  make_maps(rig.right, R2, P2, video_size, result.right_map_x, result.right_map_y);
  result.focal_px = P1.at<double>(0, 0);
  result.principal_x_px = P1.at<double>(0, 2);
  result.principal_y_px = P1.at<double>(1, 2);
  result.baseline_mm = -P2.at<double>(0, 3) / P2.at<double>(0, 0);
  cv::cv2eigen(R1, result.rectified_from_left);
  result.valid_left = valid_pixels(result.left_map_x, result.left_map_y, video_size);
  result.valid_right = valid_pixels(result.right_map_x, result.right_map_y, video_size);
  return result;
}

RectifiedPair rectify(const Rectification& rectification, const StereoFrame& frame) {
  RectifiedPair pair;
  pair.index = frame.index;
  pair.time_s = frame.time_s;
  if (rectification.identity) {
    pair.left = frame.left;
    pair.right = frame.right;
    return pair;
  }
  cv::remap(frame.left, pair.left, rectification.left_map_x, rectification.left_map_y, cv::INTER_CUBIC);
  if (!frame.right.empty())
    cv::remap(frame.right, pair.right, rectification.right_map_x, rectification.right_map_y, cv::INTER_CUBIC);
  return pair;
}

Vec3 triangulate_pixel(const Rectification& rectification, cv::Point2d left_px, double disparity_px) {
  const double z = rectification.depth_mm(disparity_px);
  const Vec3 in_rectified((left_px.x - rectification.principal_x_px) * z / rectification.focal_px,
                          (left_px.y - rectification.principal_y_px) * z / rectification.focal_px, z);
  return rectification.rectified_from_left.transpose() * in_rectified;
}

cv::Point2d project_to_rectified(const Rectification& rectification, const Vec3& point_in_left_mm) {
  const Vec3 point = rectification.rectified_from_left * point_in_left_mm;
  return {rectification.focal_px * point.x() / point.z() + rectification.principal_x_px,
          rectification.focal_px * point.y() / point.z() + rectification.principal_y_px};
}

double rectified_depth_mm(const Rectification& rectification, const Vec3& point_in_left_mm) {
  return rectification.rectified_from_left.row(2).dot(point_in_left_mm);
}

cv::Mat rectified_polygon_mask(const Rectification& rectification,
                               const std::vector<cv::Point2d>& polygon_recorded_px) {
  if (polygon_recorded_px.empty()) return cv::Mat(rectification.size, CV_8U, cv::Scalar(255));
  cv::Mat recorded(rectification.size, CV_8U, cv::Scalar(0));
  std::vector<std::vector<cv::Point>> corners(1);
  constexpr int kFractionBits = 4;
  for (const cv::Point2d& corner : polygon_recorded_px)
    corners[0].emplace_back(cvRound(corner.x * (1 << kFractionBits)), cvRound(corner.y * (1 << kFractionBits)));
  cv::fillPoly(recorded, corners, cv::Scalar(255), cv::LINE_8, kFractionBits);
  if (rectification.identity) return recorded;
  cv::Mat mask;
  cv::remap(recorded, mask, rectification.left_map_x, rectification.left_map_y, cv::INTER_NEAREST);
  return mask;
}

}  // namespace palpate
