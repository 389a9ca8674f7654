#include "palpate/simulate/noise.h"

#include <array>
#include <cmath>

namespace palpate {
namespace {

// Edge directions of a cube, as in Perlin's improved noise; the last four repeat.
const std::array<Eigen::Vector3f, 16> kDirections = [] {
  std::array<Eigen::Vector3f, 16> d;
  const float table[16][3] = {{1, 1, 0},  {-1, 1, 0},  {1, -1, 0}, {-1, -1, 0}, {1, 0, 1},  {-1, 0, 1},
                              {1, 0, -1}, {-1, 0, -1}, {0, 1, 1},  {0, -1, 1},  {0, 1, -1}, {0, -1, -1},
                              {1, 1, 0},  {-1, 1, 0},  {0, -1, 1}, {0, -1, -1}};
  for (size_t i = 0; i < 16; ++i) d[i] = Eigen::Vector3f(table[i][0], table[i][1], table[i][2]);
  return d;
}();

// hash_bits, step by step: neighbouring corners of a lattice share the first ones.
uint32_t begun(uint32_t seed) {
  return seed * 0x9E3779B9u + 0x7F4A7C15u;
}

uint32_t stirred(uint32_t h, uint32_t k) {
  h ^= k * 0xCC9E2D51u;
  return (h << 13 | h >> 19) * 5u + 0xE6546B64u;
}

uint32_t finished(uint32_t h) {
  h ^= h >> 16;
  h *= 0x85EBCA6Bu;
  h ^= h >> 13;
  h *= 0xC2B2AE35u;
  return h ^ (h >> 16);
}

}  // namespace

uint32_t hash_bits(uint32_t a, uint32_t b, uint32_t c, uint32_t seed) {
  return finished(stirred(stirred(stirred(begun(seed), a), b), c));
}

FieldValue gradient_noise(const Eigen::Vector3f& point, uint32_t seed) {
  const Eigen::Vector3f cell = point.array().floor();
  const Eigen::Vector3f t = point - cell;
  const Eigen::Vector3i corner = cell.cast<int>();
  const Eigen::Array3f a = t.array();
  const Eigen::Array3f fade = a * a * a * (a * (a * 6 - 15) + 10);
  const Eigen::Array3f slope = 30 * a * a * (a * (a - 2) + 1);

  std::array<uint32_t, 4> along_xy{};
  for (int k = 0; k < 4; ++k) {
    const uint32_t along_x = stirred(begun(seed), static_cast<uint32_t>(corner.x() + (k & 1)));
    along_xy[static_cast<size_t>(k)] = stirred(along_x, static_cast<uint32_t>(corner.y() + (k >> 1)));
  }
  FieldValue sum;
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3i o(k & 1, k >> 1 & 1, k >> 2);
    const uint32_t bits =
        finished(stirred(along_xy[static_cast<size_t>(k & 3)], static_cast<uint32_t>(corner.z() + o.z())));
    const Eigen::Vector3f& direction = kDirections[bits & 15];
    const float dot = direction.dot(t - o.cast<float>());
    const Eigen::Array3f w(o.x() ? fade.x() : 1 - fade.x(), o.y() ? fade.y() : 1 - fade.y(),
                           o.z() ? fade.z() : 1 - fade.z());
    const Eigen::Array3f dw(o.x() ? slope.x() : -slope.x(), o.y() ? slope.y() : -slope.y(),
                            o.z() ? slope.z() : -slope.z());
    const float weight = w.x() * w.y() * w.z();
    sum.value += weight * dot;
    sum.gradient += weight * direction +
                    dot * Eigen::Vector3f(dw.x() * w.y() * w.z(), w.x() * dw.y() * w.z(), w.x() * w.y() * dw.z());
  }
  return sum;
}

FieldValue fractal_noise(const Eigen::Vector3f& point, uint32_t seed, int octaves, float gain) {
  FieldValue sum;
  float strength = 1, frequency = 1;
  for (int i = 0; i < octaves; ++i) {
    const FieldValue octave = gradient_noise(point * frequency, seed + 101u * static_cast<uint32_t>(i));
    sum.value += strength * octave.value;
    sum.gradient += strength * frequency * octave.gradient;
    strength *= gain;
    frequency *= 2.03f;  // not exactly 2, so that the lattices do not fall onto each other
  }
  return sum;
}

}  // namespace palpate
