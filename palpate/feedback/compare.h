#pragma once

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "palpate/feedback/forces_file.h"

namespace palpate {

/// How well an estimate follows the truth; the names and definitions of the reference scorer. Frames are matched by
/// number; a frame of the truth without an estimate, or with one that is not finite, counts as no force, no contact, no
/// tip. What cannot be said (no contact in the truth, no tip seen, ...) is empty.
struct Comparison {
  int frames = 0;
  int missing_frames = 0;
  double true_peak_N = 0;
  double est_peak_N = 0;
  double force_rmse_N = 0;
  std::optional<double> force_nrmse_pct;  ///< of the true peak
  std::optional<double> force_rmse_contact_N;
  double force_mae_N = 0;
  std::optional<double> force_correlation;
  std::optional<double> peak_force_error_pct;
  std::optional<double> gain;  ///< best scale: estimate = gain * truth
  std::optional<double> vector_rmse_N;
  std::optional<double> vector_correlation;
  std::optional<double> direction_error_deg_median;  ///< where the true force is above a quarter of its peak
  std::optional<bool> sign_flipped;
  std::optional<int> true_onset_frame;
  std::optional<int> est_onset_frame;
  std::optional<int> onset_error_frames;
  std::optional<int> release_error_frames;
  int false_contact_frames = 0;  ///< in_contact, or a force above 1 % of the true peak, without true contact
  int missed_contact_frames = 0;
  /// Of these, from the third frame of a contact on, with a true force above 5 % of its peak.
  int missed_force_frames = 0;
  /// Status ok, and more than 90 degrees off while the true force is above 5 % of its peak.
  int reversed_ok_frames = 0;
  std::optional<int> force_onset_error_frames;  ///< by 10 % of the true peak, free of contact labels
  double false_force_max_N = 0;
  int tip_frames = 0;
  std::optional<double> tip_rmse_mm;
  std::optional<double> tip_rmse_contact_mm;
  /// Of the 95 % band, where the true force is above 5 % of its peak; empty where no row has a band. A frame without
  /// one counts as a band from 0 to 0.
  std::optional<double> band_coverage_pct;
  std::optional<double> band_half_width_pct;  ///< mean, of the true peak
};

/// Throws BadInput when the truth is empty, a magnitude in it is not finite, or its frames are numbered otherwise than
/// the estimate's by the times of both, from 1 instead of from 0.
Comparison compare(const std::vector<ForceRow>& estimate, const std::vector<ForceRow>& truth);

/// One figure by its name; std::monostate where nothing can be said.
using Figure = std::variant<std::monostate, bool, int, double>;
std::vector<std::pair<std::string, Figure>> figures_of(const Comparison& comparison);

/// "0.1234", "12", "yes", "-" .
std::string figure_text(const Figure& figure);

/// One line per figure: name, value.
std::string to_text(const Comparison& comparison);

/// One JSON object; null where nothing can be said.
std::string to_json(const Comparison& comparison);

}  // namespace palpate
