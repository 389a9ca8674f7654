#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "palpate/estimate/force_estimate.h"

namespace palpate {

/// One row of forces.csv or truth.csv. Forces of the instrument on the tissue, left camera frame.
struct ForceRow {
  int frame = 0;
  int line = 0;  ///< of the file that it was read from
  double time_s = 0;
  std::string status;  ///< "" where the file names none (truth.csv)
  bool in_contact = false;
  Vec3 force_N = Vec3::Zero();
  double force_magnitude_N = 0;  ///< column force_N
  double mean_nodal_force_N = 0;
  Vec3 tip_mm = Vec3::Zero();  ///< not to be read where has_tip() is false
  double max_von_mises_kPa = 0;
  double residual = 0;
  double frame_ms = 0;
  double misfit_mm = 0;
  std::string warnings;  ///< names separated by ";"
  /// 95 % band of the magnitude; NaN where the file names none.
  double force_low_N = std::numeric_limits<double>::quiet_NaN();
  double force_high_N = std::numeric_limits<double>::quiet_NaN();
  double force_low_total_N = 0, force_high_total_N = 0;
  std::string grip = "free";
  double p_contact = 0;
  double footprint_mm = 0;
  Vec3 scene_mm = Vec3::Zero();

  bool has_band() const { return std::isfinite(force_low_N) && std::isfinite(force_high_N); }
  bool has_tip() const { return status != "tool_lost" && tip_mm.allFinite(); }
};

/// What a status promises about force, tip and contact, made true: tool_lost is all zeros, not_converged has no force
/// but a contact, no_contact has neither. An estimate with a number that is not finite is demoted to the status that
/// claims less; no field of the answer is NaN.
ForceRow to_row(const ForceEstimate& estimate);

/// Appends one row per frame to forces.csv; every row is on the disk before the next frame, so that an interrupted run
/// keeps what is done.
class ForcesWriter {
 public:
  /// Begins the file with its header. Throws Unfinished when it cannot be written.
  explicit ForcesWriter(const std::filesystem::path& file);

  /// Throws Unfinished when the disk does not take the row.
  void write(const ForceEstimate& estimate);
  void write(const ForceRow& row);

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

/// forces_2.csv of a second instrument: begun when one comes into view, with a row for every frame.
class SecondForcesWriter {
 public:
  /// Removes what an earlier run left there.
  explicit SecondForcesWriter(const std::filesystem::path& file);

  /// The answer to a frame for all instruments. Throws Unfinished when the disk does not take it.
  void write(const ForceEstimate& estimate);
  /// Every row so far; none while no second instrument has come into view.
  std::vector<ForceRow> rows() const { return writer_ ? rows_ : std::vector<ForceRow>{}; }

 private:
  std::filesystem::path file_;
  std::optional<ForcesWriter> writer_;
  std::vector<ForceRow> rows_;
};

/// Rows of forces.csv or truth.csv in the order of the file; columns are found by name (Table). frame and force_N
/// must be there. What is missing, or is no finite number, claims nothing: a force or a tip is NaN then, in_contact
/// false. Throws BadInput: missing file, missing column, a row without frame number.
std::vector<ForceRow> read_forces(const std::filesystem::path& file);

/// The same for a truth to compare with: throws BadInput also where it has no row or a force_N that is not finite.
std::vector<ForceRow> read_truth(const std::filesystem::path& file);

}  // namespace palpate
