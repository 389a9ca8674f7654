#include "palpate/infer/band.h"

#include <algorithm>
#include <cmath>

namespace palpate {

ForceBand force_band(const Vec3& force_N, const Mat3& covariance_N2) {
  const double magnitude_N = force_N.norm();
  const Vec3 direction = magnitude_N > 0 ? Vec3(force_N / magnitude_N) : Vec3::UnitZ();
  const double deviation_N = std::sqrt(std::max(0.0, direction.dot(covariance_N2 * direction)));
  return {std::max(0.0, magnitude_N - kBandQuantile * deviation_N), magnitude_N + kBandQuantile * deviation_N};
}

double unnoticed_force_N(const TissueOptions& tissue, double radius_mm, const InferenceParameters& parameters) {
  const double nu = tissue.poisson_ratio;
  return kBandQuantile * parameters.touch_mm * 2 * radius_mm * tissue.young_modulus_MPa() / (1 - nu * nu);
}

}  // namespace palpate
