#include "palpate/contact/onset.h"

#include <algorithm>

namespace palpate {

namespace {
constexpr size_t kRecentFrames = 6;
/// A tip that moved at least this far per frame was approaching, ...
constexpr double kApproachStep_mm = 0.25;
/// ... and has come to rest when its step falls below this share of it.
constexpr double kRestShare = 0.3;
}  // namespace

bool OnsetDetector::update(double gap_mm, double gap_deviation_mm, const Vec3& tip_mm) {
  recent_tips_.push_back(tip_mm);
  if (recent_tips_.size() > kRecentFrames) recent_tips_.pop_front();

  const double reach_mm = threshold_mm_ + std::min(2 * gap_deviation_mm, threshold_mm_);
  armed_ = gap_mm <= reach_mm;
  if (gap_mm > 2 * threshold_mm_) has_left_ = true;
  if (!armed_ || !has_left_ || recent_tips_.size() < 3) return false;

  double fastest_mm = 0;
  for (size_t i = 1; i < recent_tips_.size(); ++i)
    fastest_mm = std::max(fastest_mm, (recent_tips_[i] - recent_tips_[i - 1]).norm());
  const double step_mm = (recent_tips_.back() - recent_tips_[recent_tips_.size() - 2]).norm();
  const bool came_to_rest = fastest_mm > kApproachStep_mm && step_mm < kRestShare * fastest_mm;
  const bool is_inside = gap_mm < -gap_deviation_mm;
  if (!came_to_rest && !is_inside) return false;
  has_left_ = false;
  return true;
}

void OnsetDetector::reset() {
  recent_tips_.clear();
  armed_ = false;
}

}  // namespace palpate
