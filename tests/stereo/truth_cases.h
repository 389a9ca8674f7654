#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "palpate/stereo/match.h"

namespace palpate::test {

/// A rectified pair of the reference data whose disparity is known.
struct TruthCase {
  std::string name;
  RectifiedPair pair;
  Rectification rectification;
  MatchOptions options;  ///< depths searched
  cv::Mat truth_px;      ///< CV_32F
  cv::Mat scored;        ///< 8-bit, 255 where the truth is valid and both cameras see it, as far as the case says so
  double truth_deviation_px = 0;  ///< one standard deviation of the truth itself, by how it scatters about planes
  double shift_px = 0;            ///< depth = focal * baseline / (disparity + shift)
  bool metric = false;            ///< the calibration is known, so errors can be told in mm
};

/// Names of all cases, each a folder of the reference data.
const std::vector<std::string>& truth_case_names();

/// Reads one case. Throws where a file is missing (see PALPATE_NEEDS_REFERENCE).
TruthCase read_truth_case(const std::string& name);

/// How far a disparity map lies from the truth.
struct MatchScore {
  double mean_px = 0, median_px = 0;
  double mean_mm = 0, median_mm = 0;
  double above_one_px = 0;            ///< fraction of the measured pixels
  double covered = 0;                 ///< fraction of the scored pixels that are measured
  double within_one_deviation = 0;    ///< fraction of the measured pixels whose error the stated deviation explains ...
  double within_both_deviations = 0;  ///< ... or that and the deviation of the truth
};

/// Over the scored pixels of a case that have a disparity.
MatchScore score(const DisparityMap& map, const TruthCase& truth);

}  // namespace palpate::test
