#pragma once

#include <optional>
#include <utility>
#include <vector>

namespace palpate::study {

/// How an estimated force follows one setting: a straight line through all points, or, on a logarithmic axis, a power.
struct Slope {
  double slope = 0;             ///< force per unit of the setting; on a logarithmic axis the power
  double at_zero = 0;           ///< force (logarithmic: of the natural logarithms) where the line meets the axis
  std::optional<double> error;  ///< standard error of `slope`, from three points on
};

/// Least squares through (setting, force); empty with fewer than two different settings, or where a logarithm does not
/// exist.
std::optional<Slope> slope_of(const std::vector<std::pair<double, double>>& points, bool logarithmic);

/// What an error of the setting makes of the force, relative: 0.05 = 5 % off. `uncertainty` in the setting's unit, on a
/// logarithmic axis a factor. Forces are fractions of the true one.
double effect_of(const Slope& slope, double uncertainty, bool logarithmic);

}  // namespace palpate::study
