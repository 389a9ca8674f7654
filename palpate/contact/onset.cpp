#include "palpate/contact/onset.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

constexpr size_t kRecentFrames = 8;
/// A tip that was lost for longer may have come from anywhere.
constexpr int kMostLostFrames = 8;
/// A tip that moved at least this far from one frame to the next was approaching.
constexpr double kApproachStep_mm = 0.3;
/// A tip is at rest when it moves less than this from one frame to the next: across the viewing ray, where it is seen
/// well, ...
constexpr double kRestAcross_mm = 0.15;
/// ... and along it, where endoscopic baselines leave noise.
constexpr double kRestAlong_mm = 0.6;
/// However badly the tip is known, it does not touch from twice the threshold away.
constexpr double kMostSlackShare = 0.5;
constexpr double kLeaveDistance_mm = 2;
/// One frame may be a bad triangulation.
constexpr int kFramesSurelyInside = 2;

constexpr int kMostTimesTooEarly = 3;

bool at_rest(const Vec3& before, const Vec3& now) {
  const Vec3 ray = now.normalized(), step = now - before;
  const double along = step.dot(ray);
  return (step - along * ray).norm() < kRestAcross_mm && std::abs(along) < kRestAlong_mm;
}

}  // namespace

bool OnsetDetector::update(double gap_mm, double gap_deviation_mm, const Vec3& tip_mm) {
  if (let_go_at_mm_ && (tip_mm - *let_go_at_mm_).norm() > kLeaveDistance_mm) let_go_at_mm_.reset();
  lost_frames_ = 0;
  recent_tips_.push_back(tip_mm);
  if (recent_tips_.size() > kRecentFrames) recent_tips_.pop_front();
  if (let_go_at_mm_ || recent_tips_.size() < 3) return false;

  const double slack_mm = std::min(2 * gap_deviation_mm, kMostSlackShare * threshold_mm_);
  if (gap_mm > threshold_mm_ + slack_mm) return false;
  frames_inside_ = gap_mm < -(threshold_mm_ + slack_mm) ? frames_inside_ + 1 : 0;
  if (frames_inside_ > 0) return frames_inside_ >= kFramesSurelyInside;

  double longest_step_mm = 0;
  for (size_t i = 1; i < recent_tips_.size(); ++i)
    longest_step_mm = std::max(longest_step_mm, (recent_tips_[i] - recent_tips_[i - 1]).norm());
  return longest_step_mm > kApproachStep_mm && at_rest(recent_tips_[recent_tips_.size() - 2], recent_tips_.back());
}

bool OnsetDetector::may_begin_again(double gap_mm) {
  return ++times_too_early_ <= kMostTimesTooEarly && gap_mm < threshold_mm_;
}

void OnsetDetector::lose() {
  if (++lost_frames_ > kMostLostFrames) start_again();
}

void OnsetDetector::let_go(const Vec3& tip_mm) {
  start_again();
  let_go_at_mm_ = tip_mm;
}

void OnsetDetector::start_again() {
  times_too_early_ = 0;
  recent_tips_.clear();
}

}  // namespace palpate
