#include "palpate/stereo/stamp_pairing.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "palpate/core/quantile.h"

namespace palpate {

namespace {

/// Stamps are rounded to ms by some containers.
constexpr double kRounding_s = 1e-3;

/// The step that frames have where none is dropped: most steps are as long, or longer.
double usual_step_s(const std::vector<double>& stamps_s) {
  std::vector<double> steps;
  for (size_t i = 1; i < stamps_s.size(); ++i)
    if (stamps_s[i] > stamps_s[i - 1]) steps.push_back(stamps_s[i] - stamps_s[i - 1]);
  if (steps.empty()) return 0;
  const double shortest = quantile_of(steps, 0.1);
  // Of the steps that are not longer than one and a half of the shortest, the mean: rounding cancels.
  double sum = 0;
  int count = 0;
  for (const double step : steps)
    if (step <= 1.5 * shortest && step >= 0.5 * shortest) sum += step, ++count;
  return sum / count;
}

}  // namespace

RecordingTiming timing_of(const std::vector<double>& stamps_s) {
  RecordingTiming timing;
  const double step_s = usual_step_s(stamps_s);
  if (!(step_s > 0)) return timing;
  timing.rate_Hz = 1 / step_s;
  double squared = 0;
  int steps = 0;
  for (size_t i = 1; i < stamps_s.size(); ++i) {
    const double step = stamps_s[i] - stamps_s[i - 1];
    timing.longest_gap_s = std::max(timing.longest_gap_s, step);
    if (step > 1.5 * step_s) {
      ++timing.gaps;
    } else {
      squared += (step - step_s) * (step - step_s);
      ++steps;
    }
  }
  timing.jitter_ms = steps > 0 ? 1000 * std::sqrt(squared / steps) : 0;
  return timing;
}

StampPairing pair_by_stamp(const std::vector<double>& left_s, std::vector<double> right_s, bool same_clock) {
  StampPairing pairing;
  pairing.timing = timing_of(left_s);
  if (left_s.empty() || right_s.empty()) {
    pairing.right_of_left.assign(left_s.size(), -1);
    pairing.timing.left_without_right = static_cast<int>(left_s.size());
    pairing.timing.right_without_left = static_cast<int>(right_s.size());
    return pairing;
  }
  const double step_s = usual_step_s(left_s.size() > 1 ? left_s : right_s);
  const double reach_s = step_s > 0 ? 0.5 * step_s + kRounding_s : HUGE_VAL;
  const bool overlap = right_s.front() <= left_s.back() + reach_s && left_s.front() <= right_s.back() + reach_s;
  if (!same_clock || !overlap) pairing.right_shift_s = left_s.front() - right_s.front();
  for (double& stamp : right_s) stamp += pairing.right_shift_s;
  std::vector<double> offsets;
  size_t next = 0;
  for (const double stamp : left_s) {
    while (next + 1 < right_s.size() && std::abs(right_s[next + 1] - stamp) <= std::abs(right_s[next] - stamp)) ++next;
    const bool is_near = next < right_s.size() && std::abs(right_s[next] - stamp) <= reach_s;
    pairing.right_of_left.push_back(is_near ? static_cast<int>(next) : -1);
    if (!is_near) {
      ++pairing.timing.left_without_right;
      continue;
    }
    offsets.push_back(right_s[next] - stamp);
    ++next;
  }
  pairing.timing.right_without_left = static_cast<int>(right_s.size() - offsets.size());
  if (!offsets.empty()) pairing.timing.offset_ms = 1000 * median_of(offsets);
  return pairing;
}

std::string describe_timing(const RecordingTiming& timing) {
  if (timing.is_live) return fmt::format("live, {:.2f} frames/s", timing.rate_Hz);
  if (!(timing.rate_Hz > 0)) return "rate not known";
  std::string text = fmt::format("{:.2f} frames/s, jitter {:.1f} ms", timing.rate_Hz, timing.jitter_ms);
  text += timing.gaps > 0 ? fmt::format(", {} gaps up to {:.3f} s", timing.gaps, timing.longest_gap_s) : ", no gaps";
  text += fmt::format(", right camera {:+.1f} ms", timing.offset_ms);
  if (timing.left_without_right > 0)
    text += fmt::format(", {} frames without a right image", timing.left_without_right);
  if (timing.right_without_left > 0) text += fmt::format(", {} right images left out", timing.right_without_left);
  return text;
}

}  // namespace palpate
