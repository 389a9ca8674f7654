#pragma once

#include "palpate/infer/inference_parameters.h"

namespace palpate {

/// What tissue and operator say of the radius together: mean and variance of its logarithm.
struct AgreedRadius {
  double log_radius = 0;
  double variance = 0;
};

/// The stated radius is right to stated_radius with probability stated_right, or says nothing but its order; what the
/// tissue told is known to tissue_radius besides its own variance. The mean of the mixture of both cases.
AgreedRadius agreed_radius(double told_log_radius, double told_variance, double stated_log_radius,
                           const InferenceParameters& parameters);

}  // namespace palpate
