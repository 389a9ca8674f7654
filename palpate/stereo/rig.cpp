#include "palpate/stereo/rig.h"

#include <fmt/core.h>

#include <cmath>

#include "palpate/core/errors.h"

namespace palpate {

namespace {

/// Pictures are cut, or made smaller, after the cameras were calibrated.
std::string how_they_may_fit(cv::Size calibrated, cv::Size video) {
  const double scale = static_cast<double>(video.width) / calibrated.width;
  if (std::abs(scale * calibrated.height - video.height) <= 1)
    return fmt::format("; if they were scaled after the calibration, say recording.scale: {:.6g}", scale);
  const double turned_scale = static_cast<double>(video.height) / calibrated.width;
  if (std::abs(turned_scale * calibrated.height - video.width) <= 1)
    return "; the pictures are turned by 90 degrees against the calibration, expected them as they were calibrated";
  return "; if they were cut out of larger ones after the calibration, say where by recording.crop: [x, y, width, "
         "height]";
}

}  // namespace

void check_rig_fits(const StereoRig& rig, cv::Size video_size) {
  const std::string file = rig.file.string();
  if (!rig.image_size.empty() && rig.image_size != video_size)
    throw BadInput(fmt::format("{}: the calibration is for images of {}x{} px but the video has {}x{} px{}", file,
                               rig.image_size.width, rig.image_size.height, video_size.width, video_size.height,
                               how_they_may_fit(rig.image_size, video_size)));
  for (const auto& [camera, name] : {std::pair{&rig.left, "left"}, std::pair{&rig.right, "right"}}) {
    const double cx = camera->K(0, 2), cy = camera->K(1, 2);
    const double middle_x = 0.5 * (video_size.width - 1), middle_y = 0.5 * (video_size.height - 1);
    if (std::abs(cx - middle_x) > 0.2 * video_size.width || std::abs(cy - middle_y) > 0.2 * video_size.height)
      throw BadInput(fmt::format(
          "{}: the principal point of the {} camera is ({:.1f}, {:.1f}), far from the centre ({:.1f}, {:.1f}) of the "
          "{}x{} video; expected a calibration for this image size",
          file, name, cx, cy, middle_x, middle_y, video_size.width, video_size.height));
    const double focal = camera->K(0, 0);
    if (focal < 0.2 * video_size.width || focal > 15 * video_size.width)
      throw BadInput(fmt::format(
          "{}: the focal length of the {} camera is {:.6g} px, expected {:.0f} to {:.0f} px for a video {} px wide",
          file, name, focal, 0.2 * video_size.width, 15.0 * video_size.width, video_size.width));
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
  const cv::Point2d bent =
      distorted(rig.left, {point_in_left_mm.x() / point_in_left_mm.z(), point_in_left_mm.y() / point_in_left_mm.z()});
  const cv::Matx33d& K = rig.left.K;
  return {K(0, 0) * bent.x + K(0, 1) * bent.y + K(0, 2), K(1, 1) * bent.y + K(1, 2)};
}

StereoRig cut_and_scaled(const StereoRig& rig, const cv::Rect2d& crop_px, double scale) {
  StereoRig result = rig;
  const cv::Size whole = rig.image_size;
  if (!whole.empty() && !crop_px.empty() && (cv::Rect2d({0, 0}, cv::Size2d(whole)) & crop_px) != crop_px)
    throw BadInput(
        fmt::format("recording.crop is [{:g}, {:g}, {:g}, {:g}], expected a part of the {}x{} px that {} is for",
                    crop_px.x, crop_px.y, crop_px.width, crop_px.height, whole.width, whole.height, rig.file.string()));
  for (Camera* camera : {&result.left, &result.right}) {
    camera->K(0, 2) = (camera->K(0, 2) - crop_px.x + 0.5) * scale - 0.5;
    camera->K(1, 2) = (camera->K(1, 2) - crop_px.y + 0.5) * scale - 0.5;
    camera->K(0, 0) *= scale;
    camera->K(0, 1) *= scale;
    camera->K(1, 1) *= scale;
  }
  const cv::Size2d kept = crop_px.empty() ? cv::Size2d(whole) : crop_px.size();
  result.image_size = {cvRound(kept.width * scale), cvRound(kept.height * scale)};
  return result;
}

}  // namespace palpate
