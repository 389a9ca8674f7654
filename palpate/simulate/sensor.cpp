#include "palpate/simulate/sensor.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "palpate/simulate/noise.h"

namespace palpate {
namespace {

const float kShoulder = 0.7f;  // brighter light is compressed, so that highlights do not clip hard

float compressed(float light) {
  if (light <= kShoulder) return light;
  return 1 - (1 - kShoulder) * std::exp(-(light - kShoulder) / (1 - kShoulder));
}

float srgb(float light) {
  return light <= 0.0031308f ? 12.92f * light : 1.055f * std::pow(light, 1 / 2.4f) - 0.055f;
}

const int kTableSteps = 8192;
const float kTableEnd = 4;

struct Level {
  float level;      // 0..255
  float deviation;  // of its noise
};

// Light 0..kTableEnd, finer in the dark (square-root spacing).
std::array<Level, kTableSteps + 1> level_table(const SimulatedNoise& noise) {
  const float read2 = static_cast<float>(noise.read_levels * noise.read_levels);
  const float shot2 = static_cast<float>(noise.shot_levels * noise.shot_levels) / 255;
  std::array<Level, kTableSteps + 1> table{};
  for (int i = 0; i <= kTableSteps; ++i) {
    const float root = static_cast<float>(i) / kTableSteps;
    const float level = 255 * srgb(compressed(root * root * kTableEnd));
    table[static_cast<size_t>(i)] = {level, std::sqrt(read2 + shot2 * level)};
  }
  return table;
}

// Sum of four uniforms: near enough to normal, standard deviation 1.
float normal_from(uint32_t bits) {
  const float sum = static_cast<float>((bits & 255) + (bits >> 8 & 255) + (bits >> 16 & 255) + (bits >> 24));
  return (sum - 510) / 147.8f;
}

}  // namespace

float light_from_level(float level) {
  const float s = std::clamp(level / 255, 0.0f, 0.998f);
  const float light = s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
  return light <= kShoulder ? light : kShoulder - (1 - kShoulder) * std::log((1 - light) / (1 - kShoulder));
}

cv::Mat sensor_image(const cv::Mat& linear_bgr, const SimulatedNoise& noise, uint32_t seed) {
  const auto table = level_table(noise);
  cv::Mat image(linear_bgr.size(), CV_8UC3);
  tbb::parallel_for(0, image.rows, [&](int y) {
    const auto* light = linear_bgr.ptr<float>(y);
    auto* out = image.ptr<uchar>(y);
    for (int i = 0; i < 3 * image.cols; ++i) {
      const float root = std::sqrt(std::clamp(light[i] / kTableEnd, 0.0f, 1.0f));
      const auto& [level, deviation] = table[static_cast<size_t>(root * kTableSteps + 0.5f)];
      const uint32_t bits = hash_bits(static_cast<uint32_t>(i), static_cast<uint32_t>(y), 17, seed);
      const float noisy = level + deviation * normal_from(bits);
      out[i] = cv::saturate_cast<uchar>(noisy);
    }
  });
  return image;
}

}  // namespace palpate
