#include "palpate/feedback/axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace palpate {

double round_up(double value) {
  if (!(value > 0)) return 1;
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0})
    if (value <= digit * decade * (1 + 1e-9)) return digit * decade;
  return 10 * decade;
}

std::vector<double> round_ticks(double min, double max, int count) {
  if (!(max > min)) return {min};
  const double step = round_up((max - min) / std::max(count, 1));
  std::vector<double> ticks;
  for (double i = std::ceil(min / step - 1e-9); i * step <= max + 1e-9 * step; ++i) ticks.push_back(i * step);
  return ticks;
}

std::string tick_text(double tick) {
  return std::abs(tick) < 1e-12 ? "0" : fmt::format("{:.6g}", tick);
}

std::string three_digits(double value) {
  if (!std::isfinite(value)) return "-";
  if (std::abs(value) < 5e-4) return "0";
  const int digits = std::clamp(2 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 6);
  return fmt::format("{:.{}f}", value, digits);
}

}  // namespace palpate
