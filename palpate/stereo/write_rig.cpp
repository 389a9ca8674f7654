#include "palpate/stereo/write_rig.h"

#include <fmt/core.h>

#include <opencv2/core/eigen.hpp>

#include "palpate/core/errors.h"

namespace palpate {

namespace {

cv::Mat distortion_of(const Camera& camera) {
  cv::Mat row = cv::Mat::zeros(1, camera.lens == LensModel::fisheye ? 4 : 5, CV_64F);
  if (!camera.distortion.empty()) row = cv::Mat(camera.distortion, true).reshape(1, 1);
  return row;
}

}  // namespace

void write_rig(const std::filesystem::path& file, const StereoRig& rig, cv::Size picture_size) {
  cv::Mat R, T;
  cv::eigen2cv(rig.right_from_left, R);
  cv::eigen2cv(rig.right_from_left_mm, T);
  cv::FileStorage storage(file.string(), cv::FileStorage::WRITE);
  if (!storage.isOpened()) throw Unfinished(fmt::format("{} cannot be written", file.string()));
  storage.writeComment("px and mm; x_right = R x_left + T; pixel centres at integer coordinates");
  storage << "image_width" << picture_size.width << "image_height" << picture_size.height;
  if (rig.left.lens == LensModel::fisheye) storage << "fisheye" << 1;
  storage << "K1" << cv::Mat(rig.left.K) << "D1" << distortion_of(rig.left) << "K2" << cv::Mat(rig.right.K) << "D2"
          << distortion_of(rig.right) << "R" << R << "T" << T;
}

}  // namespace palpate
