#pragma once

#include "palpate/core/geometry.h"
#include "palpate/infer/inference_parameters.h"

namespace palpate {

/// A free tip near the surface, in the map frame.
struct FreeTip {
  double gap_mm = 0;            ///< signed distance to the surface, positive outside
  double gap_deviation_mm = 0;  ///< one standard deviation
  Vec3 step_mm = Vec3::Zero();  ///< since the last frame, against the tissue
  Mat3 step_covariance_mm2 = Mat3::Zero();
};

/// log of p(tip | it has just touched) / p(tip | it is free), and whether the touch went unnoticed before (the tip is
/// inside already).
struct TouchEvidence {
  double log_ratio = 0;
  bool unnoticed = false;
};
TouchEvidence touch_evidence(const FreeTip& tip, double seconds, const InferenceParameters& parameters);

/// log probability that a force (N, with covariance) lies in Coulomb's cone about the inward normal, against that of no
/// force at all; never above 0. `friction_error`: deviation of the coefficient, ratio to it.
double log_in_friction_cone(const Vec3& force_N, const Mat3& covariance_N2, const Vec3& outward_normal, double friction,
                            double friction_error);

/// Normal density around 0, its logarithm.
double log_normal(const Vec3& x, const Mat3& covariance);
/// Standard normal distribution function, its logarithm.
double log_normal_cdf(double x);

}  // namespace palpate
