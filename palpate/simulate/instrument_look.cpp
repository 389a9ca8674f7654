#include "palpate/simulate/instrument_look.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "palpate/simulate/noise.h"

namespace palpate {
namespace {

using Colour = Eigen::Vector3f;
using Look = SimulatedInstrument::Look;

const float kShaftFrom_mm = 26;  // back from the tip; before it are wrist and jaws
const float kRib_mm = 2.2f;

Colour mix(const Colour& a, const Colour& b, float fraction) {
  return a + std::clamp(fraction, 0.0f, 1.0f) * (b - a);
}

// Bright metal that shows the tissue around it here and there.
Texel mirror(const Eigen::Vector3f& p, uint32_t seed) {
  const float shown = 0.5f + 0.9f * fractal_noise(p / 4.0f, seed, 2).value;
  Texel texel;
  texel.albedo = mix({0.30f, 0.30f, 0.31f}, {0.34f, 0.17f, 0.15f}, shown);
  return texel;
}

Texel dark_ribbed(const Eigen::Vector3f& p, float back_mm, const Eigen::Vector3f& axis, uint32_t seed) {
  if (back_mm < kShaftFrom_mm) return mirror(p, seed);
  const float phase = 2 * 3.14159265f * back_mm / kRib_mm;
  Texel texel;
  texel.albedo = Colour(0.040f, 0.040f, 0.042f) * (1 + 0.3f * std::cos(phase));
  texel.slope = 0.35f * std::sin(phase) * axis;
  return texel;
}

Texel white_ceramic(const Eigen::Vector3f& p, float back_mm, uint32_t seed) {
  if (back_mm < kShaftFrom_mm - 8) return mirror(p, seed);
  Texel texel;
  texel.albedo = Colour(0.80f, 0.79f, 0.76f) * (1 + 0.03f * gradient_noise(p / 5.0f, seed).value);
  return texel;
}

Texel blue_tube(const Eigen::Vector3f& p, float back_mm, float angle, uint32_t seed) {
  Texel texel;
  texel.albedo = Colour(0.42f, 0.52f, 0.62f) * (1 + 0.05f * gradient_noise(p / 3.0f, seed).value);
  const float along = std::remainder(back_mm, 6.0f), around = 1.6f * std::remainder(angle, 1.5708f);
  if (back_mm > 3 && back_mm < 22 && along * along + around * around < 1) texel.albedo = Colour::Constant(0.02f);
  return texel;
}

}  // namespace

SurfaceLook instrument_look(const SimulatedInstrument& instrument, const InstrumentPlace& place, int seed_number) {
  if (instrument.look == Look::steel && instrument.blood == 0) return {steel_texture(), 1, 0.55, 0.35};
  const uint32_t seed = 1000u * static_cast<uint32_t>(seed_number) + 900u;
  const Vec3 side = place.axis.cross(Vec3(0.3, 0.9, 0.2)).normalized(), other = place.axis.cross(side);
  const Texture clean = [look = instrument.look, place, side, other, seed, steel = steel_texture()](
                            const Vec3& rest_mm, const Vec3& normal) {
    const Vec3 from_tip = rest_mm - place.tip_mm;
    const Eigen::Vector3f p = from_tip.cast<float>(), axis = place.axis.cast<float>();
    const float back_mm = -p.dot(axis);
    switch (look) {
      case Look::dark_ribbed:
        return dark_ribbed(p, back_mm, axis, seed);
      case Look::white_ceramic:
        return white_ceramic(p, back_mm, seed);
      case Look::blue_tube:
        return blue_tube(p, back_mm, static_cast<float>(std::atan2(from_tip.dot(side), from_tip.dot(other))), seed);
      case Look::steel:
        break;
    }
    return steel(rest_mm, normal);
  };
  SurfaceLook result{bloody(clean, {instrument.blood, 6}, seed_number + 1), 6, 0.45, 0.20};
  if (instrument.look == Look::white_ceramic || instrument.look == Look::blue_tube) result.reflectance = 0.06;
  if (instrument.look == Look::dark_ribbed) result.reflectance = 0.05;
  return result;
}

}  // namespace palpate
