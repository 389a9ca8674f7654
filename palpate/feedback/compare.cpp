#include "palpate/feedback/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "palpate/core/errors.h"
#include "palpate/core/quantile.h"

namespace palpate {
namespace {

constexpr double kLoadedFraction = 0.05;  // of the true peak
constexpr int kFramesToNotice = 2;        // at the beginning of a contact

/// Truth and estimate of the same frame, side by side, ascending in frame.
struct Pairing {
  std::vector<int> frame;
  std::vector<char> true_contact, contact;
  Eigen::VectorXd true_force, force;             // magnitudes, N
  Eigen::Matrix3Xd true_vector, vector;          // N
  std::vector<std::optional<double>> tip_error;  // mm
  std::vector<char> ok;                          // status of the estimate
  std::vector<double> low_N, high_N;             // of its band
  bool has_band = false;
  int missing = 0;
};

double finite_or_zero(double value) {
  return std::isfinite(value) ? value : 0.0;
}

std::map<int, ForceRow> by_frame(const std::vector<ForceRow>& rows) {
  std::map<int, ForceRow> result;
  for (const ForceRow& row : rows) result[row.frame] = row;
  return result;
}

/// Frames that one table counts from 1 and the other from 0 would be paired one off. Where both begin with the same
/// number, only their clocks differ.
void require_same_numbers(const std::map<int, ForceRow>& estimates, const std::map<int, ForceRow>& truths) {
  if (estimates.size() < 2 || truths.empty() || estimates.begin()->first == truths.begin()->first) return;
  const auto has_times = [](const std::map<int, ForceRow>& rows) {
    return std::any_of(rows.begin(), rows.end(), [](const auto& row) { return row.second.time_s != 0; });
  };
  if (!has_times(estimates) || !has_times(truths)) return;
  const ForceRow &first = estimates.begin()->second, &last = estimates.rbegin()->second;
  const double step_s = (last.time_s - first.time_s) / (last.frame - first.frame);
  std::vector<double> differences;
  const ForceRow* seen = nullptr;
  for (const auto& [frame, row] : truths)
    if (const auto found = estimates.find(frame); found != estimates.end()) {
      differences.push_back((row.time_s - found->second.time_s) / step_s);
      if (!seen) seen = &row;
    }
  if (!seen || !(step_s > 0)) return;
  const double frames = quantile_of(differences, 0.5);
  constexpr double kWhole = 0.25;
  if (std::abs(frames) < 1 - kWhole || std::abs(frames - std::round(frames)) > kWhole) return;
  throw BadInput(fmt::format(
      "line {} of the truth has frame {} at {:g} s, which the estimate has at {:g} s, and its first frame, "
      "{}, at {:g} s; expected frames of the same time to have the same number, counted from {}",
      seen->line, seen->frame, seen->time_s, estimates.at(seen->frame).time_s, first.frame, first.time_s, first.frame));
}

Pairing pair_up(const std::vector<ForceRow>& estimate, const std::vector<ForceRow>& truth) {
  const std::map<int, ForceRow> estimates = by_frame(estimate), truths = by_frame(truth);
  require_same_numbers(estimates, truths);
  const Eigen::Index n = static_cast<Eigen::Index>(truths.size());
  Pairing p;
  p.true_force = p.force = Eigen::VectorXd::Zero(n);
  p.true_vector = p.vector = Eigen::Matrix3Xd::Zero(3, n);
  Eigen::Index i = 0;
  for (const auto& [frame, t] : truths) {
    if (!std::isfinite(t.force_magnitude_N))
      throw BadInput(fmt::format("the truth of frame {} is not finite, expected a force in N", frame));
    p.frame.push_back(frame);
    p.true_contact.push_back(t.in_contact);
    p.true_force[i] = t.force_magnitude_N;
    p.true_vector.col(i) = t.force_N;
    p.contact.push_back(false);
    p.tip_error.emplace_back();
    p.ok.push_back(false);
    p.low_N.push_back(0);
    p.high_N.push_back(0);
    const auto found = estimates.find(frame);
    if (found == estimates.end()) {
      ++p.missing;
    } else {
      const ForceRow& e = found->second;
      p.contact.back() = e.in_contact;
      p.force[i] = finite_or_zero(e.force_magnitude_N);
      p.vector.col(i) = e.force_N.unaryExpr(&finite_or_zero);
      if (e.has_tip() && t.has_tip()) p.tip_error.back() = (e.tip_mm - t.tip_mm).norm();
      p.ok.back() = e.status == "ok";
      if (e.has_band()) {
        p.has_band = true;
        p.low_N.back() = e.force_low_N;
        p.high_N.back() = e.force_high_N;
      }
    }
    ++i;
  }
  return p;
}

/// Frames in which the force is worth judging.
bool is_loaded(const Pairing& p, const Comparison& c, size_t i) {
  return p.true_force[static_cast<Eigen::Index>(i)] > kLoadedFraction * c.true_peak_N;
}

std::optional<double> correlation(const Eigen::ArrayXd& a, const Eigen::ArrayXd& b) {
  const Eigen::ArrayXd da = a - a.mean(), db = b - b.mean();
  const double scale = std::sqrt(da.square().sum() * db.square().sum());
  if (!(scale > 0)) return std::nullopt;
  return (da * db).sum() / scale;
}

template <class Condition>
std::optional<int> first_frame(const Pairing& p, Condition condition) {
  for (size_t i = 0; i < p.frame.size(); ++i)
    if (condition(i)) return p.frame[i];
  return std::nullopt;
}

template <class Condition>
std::optional<int> last_frame(const Pairing& p, Condition condition) {
  for (size_t i = p.frame.size(); i-- > 0;)
    if (condition(i)) return p.frame[i];
  return std::nullopt;
}

std::optional<int> difference(std::optional<int> a, std::optional<int> b) {
  if (!a || !b) return std::nullopt;
  return *a - *b;
}

std::optional<double> root_mean_square(const std::vector<double>& errors) {
  if (errors.empty()) return std::nullopt;
  double sum = 0;
  for (const double error : errors) sum += error * error;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

void compare_magnitudes(const Pairing& p, Comparison& c) {
  const Eigen::VectorXd error = p.force - p.true_force;
  const double n = static_cast<double>(c.frames);
  c.true_peak_N = p.true_force.maxCoeff();
  c.est_peak_N = p.force.maxCoeff();
  c.force_rmse_N = std::sqrt(error.squaredNorm() / n);
  c.force_mae_N = error.cwiseAbs().sum() / n;
  c.force_correlation = correlation(p.force.array(), p.true_force.array());
  if (c.true_peak_N > 0) {
    c.force_nrmse_pct = 100 * c.force_rmse_N / c.true_peak_N;
    c.peak_force_error_pct = 100 * (c.est_peak_N - c.true_peak_N) / c.true_peak_N;
    c.gain = p.force.dot(p.true_force) / p.true_force.squaredNorm();
  }
  std::vector<double> in_contact;
  int since_onset = 0;
  for (size_t i = 0; i < p.frame.size(); ++i) {
    since_onset = p.true_contact[i] ? since_onset + 1 : 0;
    c.missed_force_frames += since_onset > kFramesToNotice && is_loaded(p, c, i) && !p.contact[i];
    const double force = p.force[static_cast<Eigen::Index>(i)];
    if (p.true_contact[i]) {
      in_contact.push_back(error[static_cast<Eigen::Index>(i)]);
      c.missed_contact_frames += !p.contact[i];
    } else {
      c.false_force_max_N = std::max(c.false_force_max_N, force);
      c.false_contact_frames += p.contact[i] || force > 0.01 * c.true_peak_N;
    }
  }
  c.force_rmse_contact_N = root_mean_square(in_contact);
}

void compare_vectors(const Pairing& p, Comparison& c) {
  if (!p.true_vector.allFinite()) return;  // a truth that knows the magnitude only
  const Eigen::Matrix3Xd error = p.vector - p.true_vector;
  c.vector_rmse_N = std::sqrt(error.squaredNorm() / c.frames);
  c.vector_correlation = correlation(p.vector.reshaped().array(), p.true_vector.reshaped().array());
  for (size_t i = 0; i < p.frame.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    c.reversed_ok_frames += p.ok[i] && is_loaded(p, c, i) && p.vector.col(column).dot(p.true_vector.col(column)) < 0;
  }
  std::vector<double> cosines, angles_deg;
  for (Eigen::Index i = 0; i < p.force.size(); ++i) {
    const double length = p.vector.col(i).norm();
    if (!(p.true_force[i] > 0.25 * c.true_peak_N) || !(length > 1e-9)) continue;
    cosines.push_back(p.vector.col(i).dot(p.true_vector.col(i)) / length / p.true_force[i]);
    angles_deg.push_back(std::acos(std::clamp(cosines.back(), -1.0, 1.0)) * 180 / M_PI);
  }
  if (cosines.empty()) return;
  c.direction_error_deg_median = median(angles_deg);
  c.sign_flipped = median(cosines) < -0.3;
}

void compare_times(const Pairing& p, Comparison& c) {
  const auto true_contact = [&](size_t i) { return p.true_contact[i] != 0; };
  const auto contact = [&](size_t i) { return p.contact[i] != 0; };
  const auto above_tenth = [&](const Eigen::VectorXd& force) {
    return [&](size_t i) { return force[static_cast<Eigen::Index>(i)] > 0.1 * c.true_peak_N; };
  };
  c.true_onset_frame = first_frame(p, true_contact);
  c.est_onset_frame = first_frame(p, contact);
  c.onset_error_frames = difference(c.est_onset_frame, c.true_onset_frame);
  c.release_error_frames = difference(last_frame(p, contact), last_frame(p, true_contact));
  c.force_onset_error_frames =
      difference(first_frame(p, above_tenth(p.force)), first_frame(p, above_tenth(p.true_force)));
}

void compare_tips(const Pairing& p, Comparison& c) {
  std::vector<double> all, in_contact;
  for (size_t i = 0; i < p.frame.size(); ++i) {
    if (!p.tip_error[i]) continue;
    all.push_back(*p.tip_error[i]);
    if (p.true_contact[i]) in_contact.push_back(*p.tip_error[i]);
  }
  c.tip_frames = static_cast<int>(all.size());
  c.tip_rmse_mm = root_mean_square(all);
  c.tip_rmse_contact_mm = root_mean_square(in_contact);
}

void compare_bands(const Pairing& p, Comparison& c) {
  if (!p.has_band) return;
  int loaded = 0, inside = 0;
  double width_N = 0;
  for (size_t i = 0; i < p.frame.size(); ++i) {
    if (!is_loaded(p, c, i)) continue;
    const double force = p.true_force[static_cast<Eigen::Index>(i)];
    ++loaded;
    inside += p.low_N[i] <= force && force <= p.high_N[i];
    width_N += p.high_N[i] - p.low_N[i];
  }
  if (loaded == 0) return;
  c.band_coverage_pct = 100.0 * inside / loaded;
  c.band_half_width_pct = 50 * width_N / loaded / c.true_peak_N;
}

template <class T>
Figure figure(const std::optional<T>& value) {
  return value ? Figure(*value) : Figure();
}

}  // namespace

Comparison compare(const std::vector<ForceRow>& estimate, const std::vector<ForceRow>& truth) {
  if (truth.empty()) throw BadInput("the truth holds no frame, expected at least one row");
  const Pairing pairing = pair_up(estimate, truth);
  Comparison c;
  c.frames = static_cast<int>(pairing.frame.size());
  c.missing_frames = pairing.missing;
  compare_magnitudes(pairing, c);
  compare_vectors(pairing, c);
  compare_times(pairing, c);
  compare_tips(pairing, c);
  compare_bands(pairing, c);
  return c;
}

std::vector<std::pair<std::string, Figure>> figures_of(const Comparison& c) {
  return {{"frames", c.frames},
          {"missing_frames", c.missing_frames},
          {"true_peak_N", c.true_peak_N},
          {"est_peak_N", c.est_peak_N},
          {"force_rmse_N", c.force_rmse_N},
          {"force_nrmse_pct", figure(c.force_nrmse_pct)},
          {"force_rmse_contact_N", figure(c.force_rmse_contact_N)},
          {"force_mae_N", c.force_mae_N},
          {"force_correlation", figure(c.force_correlation)},
          {"peak_force_error_pct", figure(c.peak_force_error_pct)},
          {"gain", figure(c.gain)},
          {"vector_rmse_N", figure(c.vector_rmse_N)},
          {"vector_correlation", figure(c.vector_correlation)},
          {"direction_error_deg_median", figure(c.direction_error_deg_median)},
          {"sign_flipped", figure(c.sign_flipped)},
          {"true_onset_frame", figure(c.true_onset_frame)},
          {"est_onset_frame", figure(c.est_onset_frame)},
          {"onset_error_frames", figure(c.onset_error_frames)},
          {"release_error_frames", figure(c.release_error_frames)},
          {"false_contact_frames", c.false_contact_frames},
          {"missed_contact_frames", c.missed_contact_frames},
          {"missed_force_frames", c.missed_force_frames},
          {"reversed_ok_frames", c.reversed_ok_frames},
          {"force_onset_error_frames", figure(c.force_onset_error_frames)},
          {"false_force_max_N", c.false_force_max_N},
          {"tip_frames", c.tip_frames},
          {"tip_rmse_mm", figure(c.tip_rmse_mm)},
          {"tip_rmse_contact_mm", figure(c.tip_rmse_contact_mm)},
          {"band_coverage_pct", figure(c.band_coverage_pct)},
          {"band_half_width_pct", figure(c.band_half_width_pct)}};
}

std::string figure_text(const Figure& figure) {
  if (const bool* value = std::get_if<bool>(&figure)) return *value ? "yes" : "no";
  if (const int* value = std::get_if<int>(&figure)) return fmt::format("{}", *value);
  if (const double* value = std::get_if<double>(&figure)) return fmt::format("{:.4f}", *value);
  return "-";
}

std::string to_text(const Comparison& comparison) {
  std::string text;
  for (const auto& [name, value] : figures_of(comparison)) text += fmt::format("{:28s} {}\n", name, figure_text(value));
  return text;
}

std::string to_json(const Comparison& comparison) {
  nlohmann::ordered_json json;
  for (const auto& [name, value] : figures_of(comparison)) {
    json[name] = nullptr;
    if (const bool* b = std::get_if<bool>(&value)) json[name] = *b;
    if (const int* i = std::get_if<int>(&value)) json[name] = *i;
    if (const double* d = std::get_if<double>(&value)) json[name] = *d;
  }
  return json.dump(1);
}

}  // namespace palpate
