#pragma once

#include <opencv2/core.hpp>

#include "palpate/core/geometry.h"
#include "palpate/simulate/simulate_options.h"

namespace palpate {

/// Light that arrives at both cameras, before scope and sensor: linear BGR (CV_32FC3, 1 = white). `left_depth_mm` is
/// CV_32F: depth along the optical axis at the pixel centres of the left camera, infinite where nothing is.
struct StereoLight {
  cv::Mat left, right, left_depth_mm;
};

/// Smoke in the cavity: light is lost on its way and grey light is added, c' = t c + (1 - t) grey with
/// t = exp(-density depth / 100 mm) (Koschmieder). Wisps are a field in space that drifts with time, the same for both
/// cameras. `eye_mm`: place of the camera.
void add_smoke(cv::Mat& linear_bgr, const cv::Mat& depth_mm, const SimulatedCamera& camera, const SimulatedLook& look,
               const Vec3& camera_mm, double time_s);

/// Dark outside the round field of view of the scope, blurred at its edge.
void add_border(cv::Mat& linear_bgr, const SimulatedBorder& border);

/// Even rows of the first, odd rows of the second.
cv::Mat woven(const cv::Mat& even_field, const cv::Mat& odd_field);
StereoLight woven(const StereoLight& even_field, const StereoLight& odd_field);

/// What scope and sensor make of the light: border, curve and noise; 8-bit BGR. `index` is the frame and seeds the
/// noise.
StereoFrame recorded(const StereoLight& light, const SimulatedCamera& camera, const SimulatedLook& look, int index);

}  // namespace palpate
