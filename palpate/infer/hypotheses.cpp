#include "palpate/infer/hypotheses.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

namespace {

double log_normal(double x, double deviation) {
  return -0.5 * x * x / (deviation * deviation) - std::log(deviation * std::sqrt(2 * std::numbers::pi));
}

double log_sum(double a, double b) {
  const double max = std::max(a, b);
  return max + std::log(std::exp(a - max) + std::exp(b - max));
}

}  // namespace

double log_normal(const Vec3& x, const Mat3& covariance) {
  return -0.5 *
         (x.dot(covariance.llt().solve(x)) + std::log(covariance.determinant()) + 3 * std::log(2 * std::numbers::pi));
}

double log_normal_cdf(double x) {
  if (x > -10) return std::log(0.5 * std::erfc(-x / std::numbers::sqrt2));
  return -0.5 * x * x - std::log(-x * std::sqrt(2 * std::numbers::pi));
}

TouchEvidence touch_evidence(const FreeTip& tip, double seconds, const InferenceParameters& parameters) {
  const double gap_deviation_mm = std::hypot(tip.gap_deviation_mm, parameters.gap_mm);
  const auto step_within = [&tip, seconds](double mm_per_s) {
    const double mm = mm_per_s * seconds;
    return log_normal(tip.step_mm, tip.step_covariance_mm2 + mm * mm * Mat3::Identity());
  };
  const double moving = step_within(parameters.hand_mm_per_s), resting = step_within(parameters.resting_mm_per_s);
  const double if_free = moving + log_normal_cdf(tip.gap_mm / gap_deviation_mm) - std::log(parameters.free_space_mm);
  const double noticed = std::log1p(-parameters.unnoticed) + resting + log_normal(tip.gap_mm, gap_deviation_mm);
  // Anywhere inside, blurred by how well the surface is known.
  const double inside = log_normal_cdf(-tip.gap_mm / gap_deviation_mm) +
                        log_normal_cdf((tip.gap_mm + parameters.inside_mm) / gap_deviation_mm);
  const double unnoticed = std::log(parameters.unnoticed) + moving + inside - std::log(parameters.inside_mm);
  return {log_sum(noticed, unnoticed) - if_free, unnoticed > noticed};
}

double log_in_friction_cone(const Vec3& force_N, const Mat3& covariance_N2, const Vec3& outward_normal, double friction,
                            double friction_error) {
  const double pressed_N = -force_N.dot(outward_normal);
  const Vec3 tangential_N = force_N + pressed_N * outward_normal;
  const double deviation_N = std::sqrt(std::max(outward_normal.dot(covariance_N2 * outward_normal), 1e-18));
  const double along_N = tangential_N.norm();
  const Vec3 direction = along_N > 0 ? Vec3(tangential_N / along_N) : outward_normal.unitOrthogonal();
  const double cone_deviation_N =
      std::sqrt(std::max(direction.dot(covariance_N2 * direction), 1e-18) + std::pow(friction * deviation_N, 2) +
                std::pow(friction_error * friction * std::max(pressed_N, 0.0), 2));
  const double log_probability = log_normal_cdf(pressed_N / deviation_N) +
                                 log_normal_cdf((friction * std::max(pressed_N, 0.0) - along_N) / cone_deviation_N);
  return std::min(0.0, log_probability - 2 * std::log(0.5));
}

}  // namespace palpate
