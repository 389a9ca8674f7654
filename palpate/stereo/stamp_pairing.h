#pragma once

#include <vector>

#include "palpate/stereo/recording.h"

namespace palpate {

/// Which frame of the right camera belongs to each of the left one.
struct StampPairing {
  std::vector<int> right_of_left;  ///< index of the right frame, -1 = none
  double right_shift_s = 0;        ///< that is added to the right stamps to compare them with the left ones
  RecordingTiming timing;
};

/// Each right frame at most once, to the left frame that it is nearest to, no further than half a usual step of the
/// left ones. Both ascend. `same_clock` says that the stamps can be compared as they are; otherwise, and where they do
/// not overlap, both are counted from their first.
StampPairing pair_by_stamp(const std::vector<double>& left_s, std::vector<double> right_s, bool same_clock);

/// Usual step, jitter and gaps of one camera.
RecordingTiming timing_of(const std::vector<double>& stamps_s);

}  // namespace palpate
