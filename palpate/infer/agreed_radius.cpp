#include "palpate/infer/agreed_radius.h"

#include <cmath>

namespace palpate {

AgreedRadius agreed_radius(double told_log_radius, double told_variance, double stated_log_radius,
                           const InferenceParameters& parameters) {
  const double apart = told_log_radius - stated_log_radius;
  const double tissue = told_variance + std::pow(parameters.tissue_radius, 2),
               right = std::pow(parameters.stated_radius, 2), order = std::pow(parameters.log_radius, 2);
  const auto density = [apart](double variance) {
    return std::exp(-0.5 * apart * apart / variance) / std::sqrt(variance);
  };
  const double if_right = parameters.stated_right * density(right + tissue),
               if_not = (1 - parameters.stated_right) * density(order + tissue);
  const double p = if_right / (if_right + if_not);
  const double mean_if_right = stated_log_radius + apart * right / (right + tissue);
  const double within = p * right * tissue / (right + tissue) + (1 - p) * tissue,
               between = p * (1 - p) * std::pow(told_log_radius - mean_if_right, 2);
  return {p * mean_if_right + (1 - p) * told_log_radius, within + between};
}

}  // namespace palpate
