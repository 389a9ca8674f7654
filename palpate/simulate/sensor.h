#pragma once

#include <opencv2/core.hpp>

#include "palpate/simulate/simulate_options.h"

namespace palpate {

/// What a sensor makes of light: linear BGR (CV_32FC3, 1 = white) -> 8-bit BGR with a soft shoulder, the sRGB curve,
/// read and shot noise. The noise of a pixel depends on its place and the seed only.
cv::Mat sensor_image(const cv::Mat& linear_bgr, const SimulatedNoise& noise, uint32_t seed);

/// The light that a level 0..255 stands for, without noise: the inverse of the sensor's curve.
float light_from_level(float level);

}  // namespace palpate
