#include "app/modulus.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "app/verbs.h"
#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"
#include "palpate/feedback/sensor_log.h"

namespace palpate::app {

namespace {

/// A known force is compared with the frames so near to its moment.
constexpr double kNear_s = 0.1;
/// Frames with less of the peak say little of the ratio.
constexpr double kLoadedRatio = 0.25;

bool is_loaded(const ForceRow& row) {
  return row.status == "ok" && row.force_magnitude_N > 0;
}

/// Half the width of the total band in the logarithm: by what factor the estimate may be off either way.
double log_half_width(const ForceRow& row) {
  const double low = std::max(row.force_low_total_N, 1e-3 * row.force_magnitude_N);
  return 0.5 * std::log(row.force_high_total_N / low);
}

std::string contact_times(const std::vector<ForceRow>& rows) {
  const auto first = std::find_if(rows.begin(), rows.end(), is_loaded);
  if (first == rows.end()) return "there is none in the whole recording";
  const auto last = std::find_if(rows.rbegin(), rows.rend(), is_loaded);
  return fmt::format("there is contact between {:.2f} and {:.2f} s", first->time_s, last->time_s);
}

MeasuredModulus with_band(double young_modulus_kPa, double log_half_width, size_t frames, std::string measured) {
  return {young_modulus_kPa, young_modulus_kPa * std::exp(-log_half_width),
          young_modulus_kPa * std::exp(log_half_width), static_cast<int>(frames), std::move(measured)};
}

/// Where a scalar of the file begins in its text; the file may begin with a byte order mark.
size_t place_in(const std::string& text, const YAML::Node& node) {
  const std::string& scalar = node.Scalar();
  constexpr size_t kByteOrderMark = 3;
  for (const size_t shift : {size_t{0}, kByteOrderMark}) {
    size_t at = static_cast<size_t>(std::max(0, node.Mark().pos)) + shift;
    if (at < text.size() && (text[at] == '"' || text[at] == '\'')) ++at;
    if (text.compare(at, scalar.size(), scalar) == 0) return at;
  }
  throw BadInput("tissue is not written as text that can be replaced; write the modulus by hand");
}

}  // namespace

KnownForce parse_known_force(const std::string& text) {
  KnownForce known;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf@%lf%c", &known.force_N, &known.time_s, &rest) != 2 || !(known.force_N > 0) ||
      !std::isfinite(known.force_N) || !std::isfinite(known.time_s))
    throw WrongUse(
        fmt::format("--known-force is '{}', expected force in N and time of the video in s, as in 1.5@3.2", text));
  return known;
}

MeasuredModulus modulus_from_known_force(const std::vector<ForceRow>& estimated, double assumed_kPa,
                                         const KnownForce& known) {
  std::vector<double> ratios, half_widths;
  for (const ForceRow& row : estimated) {
    if (!is_loaded(row) || std::abs(row.time_s - known.time_s) > kNear_s) continue;
    ratios.push_back(known.force_N / row.force_magnitude_N);
    half_widths.push_back(log_half_width(row));
  }
  if (ratios.empty())
    throw BadInput(fmt::format("--known-force names {:g} s, where the estimate has no contact; {}", known.time_s,
                               contact_times(estimated)));
  return with_band(assumed_kPa * quantile_of(ratios, 0.5), quantile_of(half_widths, 0.5), ratios.size(),
                   fmt::format("{:g} N at {:g} s", known.force_N, known.time_s));
}

MeasuredModulus modulus_from_sensor(const std::vector<ForceRow>& estimated, double assumed_kPa,
                                    const std::filesystem::path& log) {
  if (std::none_of(estimated.begin(), estimated.end(), is_loaded))
    throw BadInput(
        fmt::format("the estimate has no force to compare {} with: {}", log.string(), contact_times(estimated)));
  const SensorComparison found = compare_with_log(estimated, log);
  double peak_N = 0;
  for (const ForceRow& row : estimated) peak_N = std::max(peak_N, row.force_magnitude_N);
  std::vector<double> half_widths;
  for (const ForceRow& row : estimated)
    if (is_loaded(row) && row.force_magnitude_N > kLoadedRatio * peak_N) half_widths.push_back(log_half_width(row));
  // What one factor leaves of the difference is another error of the ratio, half of it at most in common.
  const double left = 0.5 * found.nrmse_scaled_pct / 100 * 1.96;
  return with_band(assumed_kPa * found.scale, std::hypot(quantile_of(half_widths, 0.5), left), half_widths.size(),
                   fmt::format("{}, clock {:+.3f} s, correlation {:.3f}", log.filename().string(), found.delay_s,
                               found.correlation));
}

std::string with_modulus(const std::string& scene_text, double young_modulus_kPa, double poisson_ratio) {
  const YAML::Node tissue = YAML::Load(scene_text)["tissue"];
  const std::string modulus = fmt::format("{:.4g}", young_modulus_kPa);
  std::string text = scene_text;
  for (auto entry : tissue) {
    const std::string key = entry.first.Scalar();
    if (key == "young_modulus_kPa") {
      size_t at = place_in(text, entry.second), length = entry.second.Scalar().size();
      if (at > 0 && (text[at - 1] == '"' || text[at - 1] == '\'')) --at, length += 2;
      return text.replace(at, length, modulus);
    }
  }
  for (auto entry : tissue) {
    if (entry.first.Scalar() != "preset") continue;
    const size_t begin = place_in(text, entry.first);
    size_t end = place_in(text, entry.second) + entry.second.Scalar().size();
    if (end < text.size() && (text[end] == '"' || text[end] == '\'')) ++end;
    const bool flow = tissue.Style() == YAML::EmitterStyle::Flow;
    const std::string between = flow ? ", " : "\n" + std::string(static_cast<size_t>(entry.first.Mark().column), ' ');
    const std::string ratio =
        tissue["poisson_ratio"] ? "" : fmt::format("{}poisson_ratio: {:g}", between, poisson_ratio);
    return text.replace(begin, end - begin, fmt::format("young_modulus_kPa: {}{}", modulus, ratio));
  }
  throw BadInput("tissue names neither young_modulus_kPa nor a preset");
}

}  // namespace palpate::app
