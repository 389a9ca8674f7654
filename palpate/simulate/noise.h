#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace palpate {

/// A smooth random field and its gradient with respect to the point.
struct FieldValue {
  float value = 0;
  Eigen::Vector3f gradient = Eigen::Vector3f::Zero();
};

/// Gradient noise (Perlin 2002, quintic fade): smooth, about -1..1, features of about one unit; the same for the same
/// seed on every machine.
FieldValue gradient_noise(const Eigen::Vector3f& point, uint32_t seed);

/// Sum of `octaves` gradient noises, each twice as fine and `gain` times as strong as the one before.
FieldValue fractal_noise(const Eigen::Vector3f& point, uint32_t seed, int octaves, float gain = 0.5f);

/// Well mixed bits of four integers (murmur finaliser).
uint32_t hash_bits(uint32_t a, uint32_t b, uint32_t c, uint32_t seed);

/// Uniform in 0..1 from hash_bits.
inline float unit_from_bits(uint32_t bits) {
  return static_cast<float>(bits >> 8) * (1.0f / 16777216.0f);
}

}  // namespace palpate
