#include "palpate/simulate/texture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "palpate/core/errors.h"
#include "palpate/simulate/noise.h"

namespace palpate {
namespace {

using Colour = Eigen::Vector3f;

const uint32_t kLevelSamples = 20000;  // of a noise whose quantiles are wanted

float smooth_step(float from, float to, float x) {
  const float t = std::clamp((x - from) / (to - from), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

Colour mix(const Colour& a, const Colour& b, float fraction) {
  return a + fraction * (b - a);
}

// Thin branching lines: where a warped noise crosses zero, thicker and thinner, interrupted. 0 none .. 1 in a vessel.
float vessels(const Eigen::Vector3f& p, float spacing_mm, float width_mm, uint32_t seed) {
  const Eigen::Vector3f q = p / spacing_mm;
  const Eigen::Vector3f warp(gradient_noise(q * 2.3f, seed + 1).value, gradient_noise(q * 2.3f, seed + 2).value,
                             gradient_noise(q * 2.3f, seed + 3).value);
  const FieldValue line = gradient_noise(q + 0.28f * warp, seed + 4);
  const float present = smooth_step(-0.05f, 0.35f, gradient_noise(q * 0.8f, seed + 5).value);
  if (present <= 0) return 0;
  const float distance_mm = std::abs(line.value) / std::max(0.4f, line.gradient.norm()) * spacing_mm;
  const float half_mm = 0.5f * width_mm * (0.35f + 0.65f * present);
  return present * (1 - smooth_step(half_mm, half_mm + 0.22f, distance_mm));
}

Texture procedural_tissue(uint32_t seed) {
  return [seed](const Vec3& rest_mm, const Vec3&) {
    const Eigen::Vector3f p = rest_mm.cast<float>();
    const float broad = fractal_noise(p / 16.0f, seed + 10, 3).value;
    const float mottle = fractal_noise(p / 4.5f, seed + 20, 3, 0.6f).value;
    const float grain = fractal_noise(p / 1.3f, seed + 30, 3, 0.75f).value;
    const float pale = smooth_step(0.12f, 0.65f, 0.7f * broad + 0.55f * mottle);
    const float fat = smooth_step(0.28f, 0.5f, fractal_noise(p / 3.2f, seed + 40, 3).value) *
                      smooth_step(0.05f, 0.4f, gradient_noise(p / 14.0f, seed + 50).value);

    Texel texel;
    Colour colour = mix({0.40f, 0.075f, 0.062f}, {0.55f, 0.15f, 0.12f}, smooth_step(-0.5f, 0.5f, mottle));
    colour = mix(colour, {0.68f, 0.32f, 0.26f}, 0.7f * pale);
    colour = mix(colour, {0.74f, 0.47f, 0.27f}, 0.5f * fat);
    const float small = std::max(vessels(p, 6.0f, 0.30f, seed + 60), vessels(p, 9.0f, 0.45f, seed + 65));
    const float large = vessels(p, 17.0f, 0.9f, seed + 70);
    colour = mix(colour, {0.17f, 0.012f, 0.014f}, std::max(0.72f * small, 0.85f * large));
    texel.albedo = colour * std::clamp(1 + 0.30f * grain, 0.4f, 1.6f);

    const FieldValue swell = fractal_noise(p / 5.0f, seed + 80, 2);
    const FieldValue ripple = fractal_noise(p / 1.1f, seed + 90, 2, 0.5f);
    texel.slope = 0.10f * (swell.gradient / 5.0f) * 2.0f + 0.05f * (ripple.gradient / 1.1f);
    return texel;
  };
}

// The image repeated by mirroring, laid on along the three axes of the camera and blended by the normal.
class TriplanarImage {
 public:
  TriplanarImage(const cv::Mat& linear_bgr, double mm_per_px) : mm_per_px_(mm_per_px), linear_(linear_bgr) {}

  Colour at(const Vec3& p, const Vec3& normal) const {
    const Vec3 weight = normal.array().abs().pow(4);
    const Colour sum = static_cast<float>(weight.x()) * sample(p.y(), p.z()) +
                       static_cast<float>(weight.y()) * sample(p.x(), p.z()) +
                       static_cast<float>(weight.z()) * sample(p.x(), p.y());
    return sum / static_cast<float>(std::max(1e-9, weight.sum()));
  }

 private:
  Colour sample(double a_mm, double b_mm) const {
    const double x = a_mm / mm_per_px_ + linear_.cols / 2.0, y = b_mm / mm_per_px_ + linear_.rows / 2.0;
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const float fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
    return mix(mix(pixel(x0, y0), pixel(x0 + 1, y0), fx), mix(pixel(x0, y0 + 1), pixel(x0 + 1, y0 + 1), fx), fy);
  }

  Colour pixel(int x, int y) const {
    const auto& bgr = linear_.at<cv::Vec3f>(mirrored(y, linear_.rows), mirrored(x, linear_.cols));
    return {bgr[2], bgr[1], bgr[0]};
  }

  static int mirrored(int i, int size) {
    const int period = 2 * size;
    const int j = ((i % period) + period) % period;
    return j < size ? j : period - 1 - j;
  }

  double mm_per_px_;
  cv::Mat linear_;
};

}  // namespace

Texture image_texture(const cv::Mat& linear_bgr, double mm_per_px, int seed) {
  return [map = TriplanarImage(linear_bgr, mm_per_px), bumps = procedural_tissue(1000u * static_cast<uint32_t>(seed))](
             const Vec3& rest_mm, const Vec3& normal) {
    Texel texel = bumps(rest_mm, normal);
    texel.albedo = map.at(rest_mm, normal);
    return texel;
  };
}

Texture tissue_texture(const SimulatedLook& look) {
  const auto seed = 1000u * static_cast<uint32_t>(look.seed);
  if (look.texture == "procedural") return procedural_tissue(seed);
  const cv::Mat image = cv::imread(look.texture.string(), cv::IMREAD_COLOR);
  if (image.empty())
    throw BadInput(fmt::format("simulate.look.texture: {} is not an image that can be read", look.texture.string()));
  cv::Mat linear;
  image.convertTo(linear, CV_32FC3, 1 / 255.0);
  cv::pow(linear, 2.2, linear);
  return image_texture(linear, look.texture_mm_per_px, look.seed);
}

Texture bloody(const Texture& clean, const SimulatedBlood& blood, int seed_number) {
  if (blood.covered <= 0) return clean;
  const uint32_t seed = 1000u * static_cast<uint32_t>(seed_number) + 700u;
  const auto size_mm = static_cast<float>(blood.patch_mm);
  const auto pooled = [seed, size_mm](const Eigen::Vector3f& p) { return fractal_noise(p / size_mm, seed, 3).value; };
  // The level that the stated fraction of space lies above.
  std::vector<float> levels(kLevelSamples);
  for (uint32_t i = 0; i < kLevelSamples; ++i) {
    const auto anywhere = [&](uint32_t axis) { return 60 * size_mm * unit_from_bits(hash_bits(i, axis, 9, seed)); };
    levels[i] = pooled({anywhere(0), anywhere(1), anywhere(2)});
  }
  const auto dry = static_cast<std::ptrdiff_t>((1 - blood.covered) * (kLevelSamples - 1));
  std::nth_element(levels.begin(), levels.begin() + dry, levels.end());
  const float level = levels[static_cast<size_t>(dry)];
  return [clean, pooled, level](const Vec3& rest_mm, const Vec3& normal) {
    Texel texel = clean(rest_mm, normal);
    const float fraction = smooth_step(level - 0.03f, level + 0.03f, pooled(rest_mm.cast<float>()));
    texel.albedo = mix(texel.albedo, {0.17f, 0.008f, 0.006f}, 0.93f * fraction);
    texel.slope *= 1 - 0.8f * fraction;
    return texel;
  };
}

Texture wall_texture(int seed_number) {
  const uint32_t seed = 1000u * static_cast<uint32_t>(seed_number) + 500u;
  return [seed](const Vec3& rest_mm, const Vec3&) {
    const Eigen::Vector3f p = rest_mm.cast<float>();
    const float broad = fractal_noise(p / 30.0f, seed + 10, 3).value;
    const float mottle = fractal_noise(p / 9.0f, seed + 20, 4, 0.6f).value;
    const float grain = fractal_noise(p / 1.8f, seed + 30, 2, 0.7f).value;
    Colour colour = mix({0.075f, 0.014f, 0.009f}, {0.16f, 0.045f, 0.024f}, smooth_step(-0.5f, 0.5f, mottle));
    colour = mix(colour, {0.25f, 0.14f, 0.06f}, 0.55f * smooth_step(0.1f, 0.7f, broad + 0.6f * mottle));
    const float large = vessels(p, 24.0f, 1.6f, seed + 60), small = vessels(p, 11.0f, 0.7f, seed + 70);
    colour = mix(colour, {0.05f, 0.003f, 0.003f}, std::max(0.9f * large, 0.75f * small));
    Texel texel;
    texel.albedo = colour * std::clamp(1 + 0.35f * grain, 0.3f, 1.7f);
    texel.slope = 0.5f * fractal_noise(p / 7.0f, seed + 80, 3).gradient / 7.0f;
    return texel;
  };
}

Texture gauze_texture() {
  return [](const Vec3& rest_mm, const Vec3&) {
    const Eigen::Vector3f p = rest_mm.cast<float>();
    const float weave = std::sin(5 * p.x()) * std::sin(5 * p.y()) + 0.5f * fractal_noise(p / 4.0f, 11, 3).value;
    Texel texel;
    texel.albedo = Colour(0.72f, 0.70f, 0.66f) * std::clamp(1 + 0.15f * weave, 0.5f, 1.3f);
    return texel;
  };
}

Texture steel_texture() {
  return [](const Vec3& rest_mm, const Vec3&) {
    const float streak = gradient_noise(rest_mm.cast<float>() / 2.5f, 7).value;
    Texel texel;
    texel.albedo = Colour(0.150f, 0.155f, 0.160f) * (1 + 0.06f * streak);
    return texel;
  };
}

}  // namespace palpate
