#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "palpate/core/geometry.h"

namespace palpate {

enum class LensModel {
  brown,   ///< OpenCV's: k1 k2 p1 p2 k3, k4 k5 k6, s1 s2 s3 s4, tau_x tau_y
  fisheye  ///< Kannala and Brandt 2006: k1 k2 k3 k4 of the angle
};

/// One camera: pinhole and the distortion of its lens. Pixel centres at integer coordinates.
struct Camera {
  cv::Matx33d K = cv::Matx33d::eye();
  std::vector<double> distortion;
  LensModel lens = LensModel::brown;
};

/// A calibrated pair of cameras: x_right = right_from_left * x_left + right_from_left_mm.
struct StereoRig {
  cv::Size image_size;  ///< empty when the calibration names none
  Camera left;
  Camera right;
  Mat3 right_from_left = Mat3::Identity();
  Vec3 right_from_left_mm = Vec3::Zero();
  std::filesystem::path file;      ///< where it was read from, for error sentences
  std::vector<std::string> notes;  ///< what it was recognised as, and what was converted

  double baseline_mm() const { return right_from_left_mm.norm(); }
};

enum class TranslationUnit { detect, mm, m };

/// Reads a stereo calibration by its structure, whichever tool wrote it (docs/inputs.md names them): YAML, XML, JSON,
/// INI or text, with M1 D1 M2 D2 R T in any of their spellings, camera_info of ROS (the left file; the right one stands
/// beside it with "left" replaced by "right"), Kalibr's camchain, MATLAB's stereoParams. Intrinsics and extrinsics may
/// be two files side by side. Throws BadInput that names the keys that are there: file or value missing, R not a
/// rotation, baseline outside 1-200 mm, a lens model that is not known or that can be either of two.
StereoRig read_rig(const std::filesystem::path& calibration, TranslationUnit unit = TranslationUnit::detect);

/// The rig of pictures that were cut out of the calibrated ones (an empty rectangle: not cut) and then scaled. Throws
/// BadInput where the calibrated images do not hold the rectangle.
StereoRig cut_and_scaled(const StereoRig& rig, const cv::Rect2d& crop_px, double scale);

/// Throws BadInput when the calibration cannot belong to a video of this size (size named and different, or principal
/// point far from the centre where none is named).
void check_rig_fits(const StereoRig& rig, cv::Size video_size);

/// Width and height of what the camera sees without distortion, degrees.
cv::Point2d field_of_view_deg(const Camera& camera, cv::Size video_size);

/// "baseline 4.14 mm, focal 1035 px, field of view 63 x 53 degrees"
std::string describe_rig(const StereoRig& rig, cv::Size video_size);

/// Where the lens bends a place of the plane z = 1 to, in the same plane.
cv::Point2d distorted(const Camera& camera, cv::Point2d place);

/// Places in the plane z = 1 of recorded pixels: the inverse of lens and camera matrix.
std::vector<cv::Point2d> undistorted(const Camera& camera, const std::vector<cv::Point2d>& recorded_px);

/// Pixel of the *recorded* left image where a point of the left camera frame is seen (C_l of the paper, with
/// distortion). The point must have z > 0.
cv::Point2d project_to_recorded_left(const StereoRig& rig, const Vec3& point_in_left_mm);

/// Two images whose rows match; both cameras share focal length and principal point, so that z = focal * baseline / d.
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
