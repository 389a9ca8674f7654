#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "palpate/core/geometry.h"

namespace palpate {

/// One eye: pinhole with OpenCV distortion (k1 k2 p1 p2 k3 ...). Pixel centres at integer coordinates.
struct Camera {
  cv::Matx33d K = cv::Matx33d::eye();
  std::vector<double> distortion;
};

/// A calibrated pair of eyes: x_right = right_from_left * x_left + right_from_left_mm.
struct StereoRig {
  cv::Size image_size;  ///< empty when the calibration names none
  Camera left;
  Camera right;
  Mat3 right_from_left = Mat3::Identity();
  Vec3 right_from_left_mm = Vec3::Zero();
  std::filesystem::path file;  ///< where it was read from, for error sentences

  double baseline_mm() const { return right_from_left_mm.norm(); }
};

enum class TranslationUnit { detect, mm, m };

/// Reads OpenCV FileStorage (M1 D1 M2 D2 R T or K1 D1 K2 D2 R T, optional image size) or a ROS camera_info pair
/// (left.yaml:right.yaml of which this is the left; the right one stands beside it with "left" replaced by "right").
/// Throws BadInput: file missing, key missing, R not a rotation, baseline outside 1-200 mm.
StereoRig read_rig(const std::filesystem::path& calibration, TranslationUnit unit = TranslationUnit::detect);

/// Throws BadInput when the calibration cannot belong to a video of this size (size named and different, or principal
/// point far from the centre where none is named).
void check_rig_fits(const StereoRig& rig, cv::Size video_size);

/// Width and height of what the camera sees without distortion, degrees.
cv::Point2d field_of_view_deg(const Camera& camera, cv::Size video_size);

/// "baseline 4.14 mm, focal 1035 px, field of view 63 x 53 degrees"
std::string describe_rig(const StereoRig& rig, cv::Size video_size);

/// Pixel of the *recorded* left image where a point of the left camera frame is seen (C_l of the paper, with
/// distortion). The point must have z > 0.
cv::Point2d project_to_recorded_left(const StereoRig& rig, const Vec3& point_in_left_mm);

/// Two images whose rows match; both eyes share focal length and principal point, so that z = focal * baseline / d.
struct RectifiedPair {
  int index = 0;
  double time_s = 0;
  cv::Mat left;   ///< 8-bit BGR
  cv::Mat right;  ///< 8-bit BGR
};

/// Look-up tables and geometry of the rectified pair, made once per recording.
struct Rectification {
  cv::Size size;
  double focal_px = 0;
  double principal_x_px = 0;
  double principal_y_px = 0;
  double baseline_mm = 0;
  Mat3 rectified_from_left = Mat3::Identity();
  bool identity = false;  ///< the recording is already rectified: images pass through untouched
  cv::Mat left_map_x, left_map_y, right_map_x, right_map_y;
  cv::Mat valid_left;  ///< 8-bit, 255 where the rectified left pixel lies inside the recorded image
  cv::Mat valid_right;
  StereoRig rig;

  double disparity_px(double depth_mm) const { return focal_px * baseline_mm / depth_mm; }
  double depth_mm(double disparity) const { return focal_px * baseline_mm / disparity; }
};

Rectification make_rectification(const StereoRig& rig, cv::Size video_size);

RectifiedPair rectify(const Rectification& rectification, const StereoFrame& frame);

/// Point in the left camera frame of a rectified left pixel with a (positive) disparity.
Vec3 triangulate_pixel(const Rectification& rectification, cv::Point2d left_px, double disparity_px);

/// Rectified left pixel of a point in the left camera frame; the right one is this minus disparity_px(depth).
cv::Point2d project_to_rectified(const Rectification& rectification, const Vec3& point_in_left_mm);

/// Depth along the rectified optical axis, mm.
double rectified_depth_mm(const Rectification& rectification, const Vec3& point_in_left_mm);

/// Mask (255 inside) in the rectified left image of a polygon drawn in the left image as recorded; all 255 when the
/// polygon is empty.
cv::Mat rectified_polygon_mask(const Rectification& rectification, const std::vector<cv::Point2d>& polygon_recorded_px);

}  // namespace palpate
