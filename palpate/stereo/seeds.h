#pragma once

#include <vector>

#include "palpate/stereo/prepared_pair.h"

namespace palpate {

/// A corner of the left image found again in the right one.
struct Seed {
  cv::Point2f left_px;
  float disparity_px = 0;
};

struct Seeds {
  std::vector<Seed> matches;
  int corners = 0;           ///< looked for
  double row_offset_px = 0;  ///< median of right row minus left row
  /// One standard deviation by which the calibration shifts all disparities: along the row nobody can see it, so it is
  /// read from the rows. Half the square of their offset (seen once, against the belief that the calibration is right)
  /// and the square of how the offset wanders over the image beyond the noise of the single matches.
  double calibration_deviation_px = 0;
};

/// Corners matched by pyramidal Lucas-Kanade across the pair, checked both ways, whose disparity lies in
/// [least, most] px and whose rows agree. A coarse search along the row says where Lucas-Kanade starts.
Seeds find_seeds(const PreparedPair& prepared, double min_disparity_px, double max_disparity_px);

}  // namespace palpate
