#include "palpate/simulate/optics.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "palpate/simulate/noise.h"
#include "palpate/simulate/sensor.h"

namespace palpate {
namespace {

const float kGreyOfSmoke = 0.35f;      // of the exposure
const float kWisp_mm = 22;             // size of a wisp
const float kDrift_mm_per_s = 9;       // of the wisps, to the left and up
const float kFractionOfDepth = 0.6f;   // where on its way to the tissue a ray meets them
const float kFarthestSmoke_mm = 2000;  // stands for where nothing is
const int kCell_px = 8;                // wisps are smooth, so that they are known on a coarse grid
const uint32_t kSeedOfSmoke = 40'000'000;

// Density over the mean density, CV_32F, size of the image.
cv::Mat wisps(const cv::Mat& depth_mm, const SimulatedCamera& camera, const SimulatedLook& look, const Vec3& camera_mm,
              double time_s) {
  const cv::Size cells((depth_mm.cols + kCell_px - 1) / kCell_px, (depth_mm.rows + kCell_px - 1) / kCell_px);
  const auto strength = static_cast<float>(look.smoke.wisps);
  const auto focal = static_cast<float>(camera.focal_px);
  const Eigen::Vector3f drift = static_cast<float>(time_s) * kDrift_mm_per_s * Eigen::Vector3f(-0.8f, -0.6f, 0);
  cv::Mat coarse(cells, CV_32F);
  tbb::parallel_for(0, cells.height, [&](int j) {
    for (int i = 0; i < cells.width; ++i) {
      // Pixel in the middle of the cell, as cv::resize counts.
      const float x = kCell_px * (static_cast<float>(i) + 0.5f) - 0.5f;
      const float y = kCell_px * (static_cast<float>(j) + 0.5f) - 0.5f;
      const float depth = std::min(kFarthestSmoke_mm, depth_mm.at<float>(std::min(j * kCell_px, depth_mm.rows - 1),
                                                                         std::min(i * kCell_px, depth_mm.cols - 1)));
      const Eigen::Vector3f ray((x - 0.5f * static_cast<float>(camera.width - 1)) / focal,
                                (y - 0.5f * static_cast<float>(camera.height - 1)) / focal, 1);
      const Eigen::Vector3f point = camera_mm.cast<float>() + kFractionOfDepth * depth * ray - drift;
      const float swirl = fractal_noise(point / kWisp_mm, kSeedOfSmoke + static_cast<uint32_t>(look.seed), 3).value;
      coarse.at<float>(j, i) = std::max(0.0f, 1 + 2 * strength * swirl);
    }
  });
  cv::Mat fine;
  cv::resize(coarse, fine, cells * kCell_px, 0, 0, cv::INTER_LINEAR);
  return fine(cv::Rect({0, 0}, depth_mm.size()));
}

}  // namespace

void add_smoke(cv::Mat& linear_bgr, const cv::Mat& depth_mm, const SimulatedCamera& camera, const SimulatedLook& look,
               const Vec3& camera_mm, double time_s) {
  if (look.smoke.density <= 0) return;
  const cv::Mat relative_density = wisps(depth_mm, camera, look, camera_mm, time_s);
  const float per_mm = static_cast<float>(look.smoke.density) / 100;
  const float grey = kGreyOfSmoke * static_cast<float>(look.exposure);
  tbb::parallel_for(0, linear_bgr.rows, [&](int y) {
    for (int x = 0; x < linear_bgr.cols; ++x) {
      const float depth = std::min(kFarthestSmoke_mm, depth_mm.at<float>(y, x));
      const float passed = std::exp(-per_mm * relative_density.at<float>(y, x) * depth);
      auto& colour = linear_bgr.at<cv::Vec3f>(y, x);
      colour = passed * colour + (1 - passed) * cv::Vec3f::all(grey);
    }
  });
}

void add_border(cv::Mat& linear_bgr, const SimulatedBorder& border) {
  if (border.radius_px <= 0) return;
  const double middle_x = 0.5 * (linear_bgr.cols - 1), middle_y = 0.5 * (linear_bgr.rows - 1);
  for (int y = 0; y < linear_bgr.rows; ++y)
    for (int x = 0; x < linear_bgr.cols; ++x) {
      const double beyond = std::hypot(x - middle_x, y - middle_y) - border.radius_px;
      const double t = std::clamp(0.5 - beyond / std::max(1e-9, border.blur_px), 0.0, 1.0);
      linear_bgr.at<cv::Vec3f>(y, x) *= static_cast<float>(t * t * (3 - 2 * t));
    }
}

cv::Mat woven(const cv::Mat& even_field, const cv::Mat& odd_field) {
  cv::Mat frame = even_field.clone();
  for (int y = 1; y < frame.rows; y += 2) odd_field.row(y).copyTo(frame.row(y));
  return frame;
}

StereoLight woven(const StereoLight& even_field, const StereoLight& odd_field) {
  return {woven(even_field.left, odd_field.left), woven(even_field.right, odd_field.right),
          woven(even_field.left_depth_mm, odd_field.left_depth_mm)};
}

StereoFrame recorded(const StereoLight& light, const SimulatedCamera& camera, const SimulatedLook& look, int index) {
  const auto number = static_cast<uint32_t>(index);
  const auto seed = static_cast<uint32_t>(look.seed);
  const auto through = [&](const cv::Mat& linear, uint32_t side) {
    cv::Mat seen = linear.clone();
    add_border(seen, look.border);
    return sensor_image(seen, look.noise, hash_bits(number, side, 0, seed));
  };
  StereoFrame frame;
  frame.index = index;
  frame.time_s = index / camera.fps;
  frame.left = through(light.left, 0);
  frame.right = through(light.right, 1);
  return frame;
}

}  // namespace palpate
