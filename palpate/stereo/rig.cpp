#include "palpate/stereo/rig.h"

#include <fmt/core.h>
#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <sstream>

#include "palpate/core/errors.h"
#include "palpate/stereo/quiet_opencv.h"

namespace palpate {
namespace {

constexpr double kLeastBaseline_mm = 1;
constexpr double kMostBaseline_mm = 200;

std::string text_of(const std::filesystem::path& file) {
  if (const std::string obstacle = obstacle_to_reading(file); !obstacle.empty())
    throw BadInput(fmt::format("{} {}, expected a calibration file", file.string(), obstacle));
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

// All distances below 0.2 are metres and all above 1 are millimetres, because a baseline is 1-200 mm.
double to_mm(TranslationUnit unit, double length) {
  if (unit == TranslationUnit::mm) return 1;
  if (unit == TranslationUnit::m) return 1000;
  return length <= kMostBaseline_mm / 1000 ? 1000 : 1;
}

void check_camera(const Camera& camera, const std::string& eye, const std::string& file) {
  const double fx = camera.K(0, 0), fy = camera.K(1, 1);
  if (!(fx > 50 && fx < 20000 && fy > 50 && fy < 20000))
    throw BadInput(fmt::format("{}: focal length of the {} camera is {:.6g} x {:.6g} px, expected 50 to 20000 px", file,
                               eye, fx, fy));
  if (fx / fy > 2 || fy / fx > 2)
    throw BadInput(
        fmt::format("{}: focal lengths of the {} camera are {:.6g} and {:.6g} px, expected nearly the same in x and y",
                    file, eye, fx, fy));
  const size_t count = camera.distortion.size();
  if (count != 0 && count != 4 && count != 5 && count != 8 && count != 12)
    throw BadInput(
        fmt::format("{}: the {} camera has {} distortion coefficients, expected 4, 5, 8 or 12 (k1 k2 p1 p2 k3 ...)",
                    file, eye, count));
  for (const double coefficient : camera.distortion)
    if (!std::isfinite(coefficient))
      throw BadInput(fmt::format("{}: a distortion coefficient of the {} camera is not a number", file, eye));
}

void check_rig(const StereoRig& rig) {
  const std::string file = rig.file.string();
  check_camera(rig.left, "left", file);
  check_camera(rig.right, "right", file);
  const Mat3& R = rig.right_from_left;
  const double skew = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
  if (!(skew < 1e-3) || R.determinant() < 0)
    throw BadInput(
        fmt::format("{}: R is not a rotation (R^T R differs from the identity by {:.3g}, determinant {:.3g}; "
                    "expected less than 0.001 and 1)",
                    file, skew, R.determinant()));
  const double baseline = rig.baseline_mm();
  if (!(baseline >= kLeastBaseline_mm && baseline <= kMostBaseline_mm))
    throw BadInput(fmt::format(
        "{}: the baseline (length of T) is {:.6g} mm, expected {:g} to {:g} mm; is recording.translation_unit right?",
        file, baseline, kLeastBaseline_mm, kMostBaseline_mm));
  const Vec3 right_eye_in_left_mm = -R.transpose() * rig.right_from_left_mm;
  if (right_eye_in_left_mm.x() < 0 && -right_eye_in_left_mm.x() > 0.5 * baseline)
    throw BadInput(fmt::format(
        "{}: T puts the right eye {:.3g} mm to the left of the left eye, expected T[0] < 0 (x_right = R x_left + T); "
        "the two cameras of the calibration are exchanged or T has the opposite sign",
        file, -right_eye_in_left_mm.x()));
  if (right_eye_in_left_mm.x() < 0.5 * baseline)
    throw BadInput(fmt::format("{}: T is [{:.4g}, {:.4g}, {:.4g}] mm, expected eyes side by side (T mainly along x)",
                               file, rig.right_from_left_mm.x(), rig.right_from_left_mm.y(),
                               rig.right_from_left_mm.z()));
}

// A matrix out of the first of several keys that the file has.
cv::Mat matrix_of(const cv::FileStorage& storage, const std::vector<std::string>& keys, const std::string& file,
                  const std::vector<int>& sizes) {
  for (const std::string& key : keys) {
    const cv::FileNode node = storage[key];
    if (node.empty()) continue;
    cv::Mat matrix;
    node >> matrix;
    matrix.convertTo(matrix, CV_64F);
    bool fits = sizes.empty();
    for (const int size : sizes) fits = fits || static_cast<int>(matrix.total()) == size;
    if (!fits || !cv::checkRange(matrix))
      throw BadInput(fmt::format("{}: {} is {} x {}, expected {} finite numbers", file, key, matrix.rows, matrix.cols,
                                 sizes.empty() ? 0 : sizes.front()));
    return matrix.reshape(1, sizes.size() == 1 && sizes[0] == 9 ? 3 : 1);
  }
  throw BadInput(
      fmt::format("{}: key {} is missing, expected an OpenCV stereo calibration with M1 D1 M2 D2 R T (or K1 "
                  "K2) or a ROS camera_info",
                  file, keys.size() == 1 ? keys.front() : keys.front() + " or " + keys.back()));
}

cv::Size size_of(const cv::FileStorage& storage) {
  const auto integer = [&](const std::vector<std::string>& keys) {
    for (const std::string& key : keys)
      if (storage[key].isInt() || storage[key].isReal()) return static_cast<int>(std::lround(storage[key].real()));
    return 0;
  };
  cv::Size size(integer({"image_width", "imageWidth", "width"}), integer({"image_height", "imageHeight", "height"}));
  for (const char* key : {"image_size", "imageSize", "size"})
    if (storage[key].isSeq() && storage[key].size() == 2)
      size = {static_cast<int>(storage[key][0].real()), static_cast<int>(storage[key][1].real())};
  return size;
}

StereoRig read_opencv(const std::filesystem::path& path, TranslationUnit unit) {
  const std::string file = path.string();
  cv::FileStorage storage(file, cv::FileStorage::READ);
  if (!storage.isOpened()) throw BadInput(fmt::format("{}: not an OpenCV calibration file", file));
  StereoRig rig;
  rig.file = path;
  rig.image_size = size_of(storage);
  const auto camera = [&](const std::string& number) {
    Camera eye;
    eye.K = cv::Matx33d(matrix_of(storage, {"M" + number, "K" + number}, file, {9}).ptr<double>());
    const cv::Mat distortion = matrix_of(storage, {"D" + number}, file, {});
    eye.distortion.assign(distortion.begin<double>(), distortion.end<double>());
    return eye;
  };
  rig.left = camera("1");
  rig.right = camera("2");
  cv::Mat rotation = matrix_of(storage, {"R"}, file, {9, 3});
  if (rotation.total() == 3) cv::Rodrigues(rotation.clone(), rotation);
  cv::cv2eigen(cv::Matx33d(rotation.ptr<double>()), rig.right_from_left);
  const cv::Mat translation = matrix_of(storage, {"T"}, file, {3});
  rig.right_from_left_mm = {translation.at<double>(0), translation.at<double>(1), translation.at<double>(2)};
  rig.right_from_left_mm *= to_mm(unit, rig.right_from_left_mm.norm());
  return rig;
}

// What one ROS camera_info says.
struct CameraInfo {
  cv::Size size;
  Camera camera;
  Mat3 rectified_from_camera = Mat3::Identity();
  double shift = 0;  // of the rectified camera along x: P[0,3] / P[0,0]
};

CameraInfo read_camera_info(const std::filesystem::path& path) {
  const std::string file = path.string();
  const YAML::Node root = YAML::Load(text_of(path));
  const auto numbers = [&](const char* key, const char* other_key, size_t least) {
    YAML::Node node = root[key] ? root[key] : root[other_key];
    if (node && node.IsMap()) node = node["data"];
    if (!node || !node.IsSequence() || node.size() < least)
      throw BadInput(fmt::format("{}: key {} is missing or has fewer than {} numbers", file, key, least));
    return node.as<std::vector<double>>();
  };
  CameraInfo info;
  if (root["image_width"] && root["image_height"])
    info.size = {root["image_width"].as<int>(), root["image_height"].as<int>()};
  const std::string model = root["distortion_model"] ? root["distortion_model"].as<std::string>() : "plumb_bob";
  if (model != "plumb_bob" && model != "rational_polynomial")
    throw BadInput(fmt::format("{}: distortion_model is {}, expected plumb_bob or rational_polynomial", file, model));
  info.camera.K = cv::Matx33d(numbers("camera_matrix", "K", 9).data());
  info.camera.distortion = numbers("distortion_coefficients", "D", 0);
  const std::vector<double> R = numbers("rectification_matrix", "R", 9);
  info.rectified_from_camera << R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8];
  const std::vector<double> P = numbers("projection_matrix", "P", 12);
  if (!(P[0] > 0))
    throw BadInput(fmt::format("{}: projection_matrix begins with {:g}, expected a focal length", file, P[0]));
  info.shift = P[3] / P[0];
  return info;
}

std::filesystem::path right_beside(const std::filesystem::path& left) {
  std::string name = left.filename().string();
  const size_t at = name.rfind("left");
  if (at == std::string::npos)
    throw BadInput(
        fmt::format("{}: a camera_info pair is named by its left file, expected \"left\" in the name so that "
                    "the right one can be found beside it",
                    left.string()));
  return left.parent_path() / name.replace(at, 4, "right");
}

// In a rectified ROS pair x_right_rectified = x_left_rectified + (P_right[0,3] / P_right[0,0], 0, 0).
StereoRig read_ros(const std::filesystem::path& path, TranslationUnit unit) {
  const std::filesystem::path right_path = right_beside(path);
  const CameraInfo left = read_camera_info(path);
  const CameraInfo right = read_camera_info(right_path);
  if (left.size != right.size)
    throw BadInput(fmt::format("{} is for {}x{} px but {} for {}x{} px, expected the same size", path.string(),
                               left.size.width, left.size.height, right_path.string(), right.size.width,
                               right.size.height));
  StereoRig rig;
  rig.file = path;
  rig.image_size = left.size;
  rig.left = left.camera;
  rig.right = right.camera;
  const double shift = right.shift - left.shift;
  rig.right_from_left = right.rectified_from_camera.transpose() * left.rectified_from_camera;
  rig.right_from_left_mm = right.rectified_from_camera.transpose() * Vec3(shift * to_mm(unit, std::abs(shift)), 0, 0);
  return rig;
}

}  // namespace

StereoRig read_rig(const std::filesystem::path& calibration, TranslationUnit unit) {
  const std::string text = text_of(calibration);
  const bool is_ros = text.find("camera_matrix") != std::string::npos &&
                      text.find("projection_matrix") != std::string::npos &&
                      text.find("opencv-matrix") == std::string::npos;
  const QuietOpenCv quiet;
  StereoRig rig;
  try {
    rig = is_ros ? read_ros(calibration, unit) : read_opencv(calibration, unit);
  } catch (const cv::Exception& error) {
    throw BadInput(fmt::format("{}: the calibration cannot be read as OpenCV FileStorage ({})", calibration.string(),
                               error.err.substr(0, error.err.find('\n'))));
  } catch (const YAML::Exception& error) {
    throw BadInput(
        fmt::format("{}: the calibration cannot be read as ROS camera_info ({})", calibration.string(), error.what()));
  }
  check_rig(rig);
  return rig;
}

void check_rig_fits(const StereoRig& rig, cv::Size video_size) {
  const std::string file = rig.file.string();
  if (!rig.image_size.empty() && rig.image_size != video_size)
    throw BadInput(fmt::format("{}: the calibration is for images of {}x{} px but the video has {}x{} px", file,
                               rig.image_size.width, rig.image_size.height, video_size.width, video_size.height));
  for (const auto& [camera, eye] : {std::pair{&rig.left, "left"}, std::pair{&rig.right, "right"}}) {
    const double cx = camera->K(0, 2), cy = camera->K(1, 2);
    const double middle_x = 0.5 * (video_size.width - 1), middle_y = 0.5 * (video_size.height - 1);
    if (std::abs(cx - middle_x) > 0.2 * video_size.width || std::abs(cy - middle_y) > 0.2 * video_size.height)
      throw BadInput(fmt::format(
          "{}: the principal point of the {} camera is ({:.1f}, {:.1f}), far from the centre ({:.1f}, {:.1f}) of the "
          "{}x{} video; expected a calibration for this image size",
          file, eye, cx, cy, middle_x, middle_y, video_size.width, video_size.height));
    const double focal = camera->K(0, 0);
    if (focal < 0.2 * video_size.width || focal > 15 * video_size.width)
      throw BadInput(fmt::format(
          "{}: the focal length of the {} camera is {:.6g} px, expected {:.0f} to {:.0f} px for a video {} px wide",
          file, eye, focal, 0.2 * video_size.width, 15.0 * video_size.width, video_size.width));
  }
}

cv::Point2d field_of_view_deg(const Camera& camera, cv::Size video_size) {
  const auto degrees = [](double size, double focal) { return 2 * std::atan(0.5 * size / focal) * 180 / CV_PI; };
  return {degrees(video_size.width, camera.K(0, 0)), degrees(video_size.height, camera.K(1, 1))};
}

std::string describe_rig(const StereoRig& rig, cv::Size video_size) {
  const cv::Point2d field = field_of_view_deg(rig.left, video_size);
  return fmt::format("baseline {:.2f} mm, focal {:.0f} px, field of view {:.0f} x {:.0f} degrees", rig.baseline_mm(),
                     rig.left.K(0, 0), field.x, field.y);
}

cv::Point2d project_to_recorded_left(const StereoRig& rig, const Vec3& point_in_left_mm) {
  const double x = point_in_left_mm.x() / point_in_left_mm.z(), y = point_in_left_mm.y() / point_in_left_mm.z();
  const auto k = [&](size_t i) { return i < rig.left.distortion.size() ? rig.left.distortion[i] : 0.0; };
  const double r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
  const double radial = (1 + k(0) * r2 + k(1) * r4 + k(4) * r6) / (1 + k(5) * r2 + k(6) * r4 + k(7) * r6);
  const double xd = x * radial + 2 * k(2) * x * y + k(3) * (r2 + 2 * x * x) + k(8) * r2 + k(9) * r4;
  const double yd = y * radial + k(2) * (r2 + 2 * y * y) + 2 * k(3) * x * y + k(10) * r2 + k(11) * r4;
  const cv::Matx33d& K = rig.left.K;
  return {K(0, 0) * xd + K(0, 1) * yd + K(0, 2), K(1, 1) * yd + K(1, 2)};
}

}  // namespace palpate
