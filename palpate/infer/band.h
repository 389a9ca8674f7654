#pragma once

#include "palpate/core/geometry.h"
#include "palpate/elastic/material.h"
#include "palpate/infer/inference_parameters.h"

namespace palpate {

/// 2.5 and 97.5 % quantiles of the force's magnitude, N.
struct ForceBand {
  double low_N = 0;
  double high_N = 0;
};

/// Of a standard normal distribution: 97.5 %.
constexpr double kBandQuantile = 1.96;

ForceBand force_band(const Vec3& force_N, const Mat3& covariance_N2);

/// The force that would have gone unnoticed without a contact: what a rigid disc of this radius bears on a half-space
/// (Sneddon 1965) when it moves by as much as a touch is known to.
double unnoticed_force_N(const TissueOptions& tissue, double radius_mm, const InferenceParameters& parameters);

}  // namespace palpate
