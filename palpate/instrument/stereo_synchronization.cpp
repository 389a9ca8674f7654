#include "palpate/instrument/stereo_synchronization.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace palpate {

namespace {

constexpr size_t kFrames = 12;
constexpr double kMinMotion_px = 0.55;  // deviation of the motion from frame to frame, below which nothing can be told
constexpr double kSignificant = 5;      // deviations of the slope
constexpr double kMinSlope = 0.6, kMaxSlope = 1.6;  // of rows over motion, for one frame
constexpr double kNoLag = 0.4;

}  // namespace

void StereoSynchronization::add(int index, double left_row_px, double right_row_px) {
  if (index != last_index_ + 1) recent_.clear();
  last_index_ = index;
  recent_.push_back({left_row_px, right_row_px});
  if (recent_.size() > kFrames) recent_.pop_front();
}

std::optional<int> StereoSynchronization::frames() const {
  if (recent_.size() < kFrames) return {};
  // A right camera that is ahead by a frame sees the tip one frame's motion further: the difference of the rows is a
  // line over the motion, of slope -1. What is the same in all frames is the calibration's, not time's.
  const auto n = static_cast<double>(kFrames - 2);
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (size_t t = 1; t + 1 < kFrames; ++t) {
    const double motion = 0.5 * (recent_[t + 1].left_px - recent_[t - 1].left_px);
    const double difference = recent_[t].left_px - recent_[t].right_px;
    x += motion, y += difference;
    xx += motion * motion, xy += motion * difference, yy += difference * difference;
  }
  xx -= x * x / n, xy -= x * y / n, yy -= y * y / n;
  if (xx < n * kMinMotion_px * kMinMotion_px) return {};
  const double slope = xy / xx, unexplained = std::max(yy - slope * xy, 0.0);
  const double deviation = std::sqrt(unexplained / (n - 2) / xx);
  if (std::abs(slope) < kNoLag) return 0;
  if (std::abs(slope) < std::max(kMinSlope, kSignificant * deviation) || std::abs(slope) > kMaxSlope) return {};
  return slope < 0 ? 1 : -1;
}

}  // namespace palpate
