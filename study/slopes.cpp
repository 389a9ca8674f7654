#include "study/slopes.h"

#include <algorithm>
#include <cmath>

namespace palpate::study {

std::optional<Slope> slope_of(const std::vector<std::pair<double, double>>& points, bool logarithmic) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (const auto& [setting, force] : points) {
    if (logarithmic && (setting <= 0 || force <= 0)) return std::nullopt;
    const double a = logarithmic ? std::log(setting) : setting, b = logarithmic ? std::log(force) : force;
    n += 1;
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
    yy += b * b;
  }
  const double spread = xx - x * x / n;
  if (n < 2 || spread <= 1e-12 * xx) return std::nullopt;
  Slope found;
  found.slope = (xy - x * y / n) / spread;
  found.at_zero = (y - found.slope * x) / n;
  if (n > 2) {
    const double left = yy - y * y / n - found.slope * found.slope * spread;
    found.error = std::sqrt(std::max(0.0, left) / (n - 2) / spread);
  }
  return found;
}

double effect_of(const Slope& slope, double uncertainty, bool logarithmic) {
  return logarithmic ? std::pow(uncertainty, slope.slope) - 1 : slope.slope * uncertainty;
}

}  // namespace palpate::study
