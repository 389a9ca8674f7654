#include "palpate/instrument/eye_lag.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace palpate {

namespace {

constexpr size_t kFrames = 12;
/// RMS motion of the tip from frame to frame that stands out of what the masks' ends jitter.
constexpr double kLeastMotion_px = 1.5;
/// The rows have to agree so much better with one eye moved, as a ratio of sums of squares.
constexpr double kClearlyBetter = 0.3;

}  // namespace

void EyeLag::add(int index, double left_row_px, double right_row_px) {
  if (index != last_index_ + 1) recent_.clear();
  last_index_ = index;
  recent_.push_back({left_row_px, right_row_px});
  if (recent_.size() > kFrames) recent_.pop_front();
}

std::optional<int> EyeLag::frames() const {
  if (recent_.size() < kFrames) return {};
  std::array<double, 3> disagreement{};  // right eye ahead by -1, 0, 1
  double motion = 0;
  const auto n = static_cast<double>(kFrames - 2);
  for (size_t lag = 0; lag < 3; ++lag) {
    double sum = 0, squares = 0;  // a constant offset of the rows is the calibration's, not time's
    for (size_t t = 1; t + 1 < kFrames; ++t) {
      const double difference = recent_[t].left_px - recent_[t + 1 - lag].right_px;
      sum += difference;
      squares += difference * difference;
    }
    disagreement[lag] = squares - sum * sum / n;
  }
  for (size_t t = 1; t < kFrames; ++t) motion += std::pow(recent_[t].left_px - recent_[t - 1].left_px, 2);
  if (motion < (n + 1) * kLeastMotion_px * kLeastMotion_px) return {};
  for (const int lag : {-1, 1})
    if (disagreement[static_cast<size_t>(lag + 1)] < kClearlyBetter * disagreement[1]) return lag;
  return 0;
}

}  // namespace palpate
