#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "palpate/stereo/rig.h"

namespace palpate {

namespace {

/// Kannala and Brandt 2006, as cv::fisheye has it.
cv::Point2d distorted_by_fisheye(const std::vector<double>& k, cv::Point2d place) {
  const double r = std::hypot(place.x, place.y);
  if (r < 1e-12) return place;
  const double theta = std::atan(r), t2 = theta * theta;
  const double bent = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
  return place * (bent / r);
}

/// The plane of the sensor tilted by tau_x and tau_y, as OpenCV's coefficients 13 and 14 say.
cv::Point2d tilted(double tau_x, double tau_y, cv::Point2d place) {
  const double cx = std::cos(tau_x), sx = std::sin(tau_x), cy = std::cos(tau_y), sy = std::sin(tau_y);
  const cv::Matx33d turn_x(1, 0, 0, 0, cx, sx, 0, -sx, cx), turn_y(cy, 0, -sy, 0, 1, 0, sy, 0, cy);
  const cv::Matx33d turn = turn_y * turn_x;
  const cv::Matx33d project(turn(2, 2), 0, -turn(0, 2), 0, turn(2, 2), -turn(1, 2), 0, 0, 1);
  const cv::Vec3d at = project * turn * cv::Vec3d(place.x, place.y, 1);
  return {at[0] / at[2], at[1] / at[2]};
}

}  // namespace

cv::Point2d distorted(const Camera& camera, cv::Point2d place) {
  if (camera.lens == LensModel::fisheye) return distorted_by_fisheye(camera.distortion, place);
  const double x = place.x, y = place.y;
  const auto k = [&](size_t i) { return i < camera.distortion.size() ? camera.distortion[i] : 0.0; };
  const double r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
  const double radial = (1 + k(0) * r2 + k(1) * r4 + k(4) * r6) / (1 + k(5) * r2 + k(6) * r4 + k(7) * r6);
  const cv::Point2d bent(x * radial + 2 * k(2) * x * y + k(3) * (r2 + 2 * x * x) + k(8) * r2 + k(9) * r4,
                         y * radial + k(2) * (r2 + 2 * y * y) + 2 * k(3) * x * y + k(10) * r2 + k(11) * r4);
  return k(12) == 0 && k(13) == 0 ? bent : tilted(k(12), k(13), bent);
}

std::vector<cv::Point2d> undistorted(const Camera& camera, const std::vector<cv::Point2d>& recorded_px) {
  std::vector<cv::Point2d> places;
  if (recorded_px.empty()) return places;
  if (camera.lens == LensModel::fisheye)
    cv::fisheye::undistortPoints(recorded_px, places, camera.K, camera.distortion);
  else
    cv::undistortPoints(recorded_px, places, camera.K, camera.distortion);
  return places;
}

}  // namespace palpate
