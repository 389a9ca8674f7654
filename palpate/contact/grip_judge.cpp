#include "palpate/contact/grip_judge.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// Of a tracked point across the viewing ray, mm.
constexpr double kAcrossDeviation_mm = 0.05;
/// Neighbouring points share their errors: so many say as much as one.
constexpr double kPointsThatAgree = 6;
constexpr int kFewestPoints = 6;
/// Differences up to here (root mean square over the points) are none, mm.
constexpr double kSame_mm = 0.02;
/// A frame tells when the share is known to this deviation.
constexpr double kTellingDeviation = 0.3;
/// Tissue that is held follows less than the model says where the body is thicker or softer than assumed; tissue that
/// is not held stays.
constexpr double kMostPushingShare = 0.2, kLeastGraspingShare = 0.3;
constexpr int kFramesToTell = 2;

/// Along the viewing ray a displacement is known far worse than across it: a vector, weighted by the information.
Vec3 weighted(const Vec3& v, const TissuePoint& point) {
  const Vec3 ray = point.rest_mm.normalized();
  const double along = std::pow(kAcrossDeviation_mm / std::max(point.deviation_mm, kAcrossDeviation_mm), 2);
  return v - (1 - along) * v.dot(ray) * ray;
}

}  // namespace

void GripJudge::start(Grip grip) {
  *this = {};
  grip_ = grip;
}

void GripJudge::update(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& pushed_mm,
                       const std::vector<Vec3>& grasped_mm) {
  if (grip_ != Grip::automatic || seen.empty()) return;
  std::map<int, Motion> now;
  double common = 0, difference_squared = 0, points = 0, total = 0;
  for (size_t i = 0; i < seen.size(); ++i) {
    now[seen[i].number] = {seen[i].displacement_mm, pushed_mm[i], grasped_mm[i]};
    total += (grasped_mm[i] - pushed_mm[i]).squaredNorm();
    Motion before{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
    if (!agreed_.empty()) {
      const auto found = agreed_.find(seen[i].number);
      if (found == agreed_.end()) continue;
      before = found->second;
    }
    const Vec3 pushed = pushed_mm[i] - before.pushed_mm;
    const Vec3 difference = grasped_mm[i] - before.grasped_mm - pushed;
    const Vec3 weighted_difference = weighted(difference, seen[i]);
    common += weighted_difference.dot(seen[i].displacement_mm - before.seen_mm - pushed);
    difference_squared += weighted_difference.dot(difference);
    ++points;
  }
  if (total < kSame_mm * kSame_mm * static_cast<double>(seen.size())) {
    agreed_ = std::move(now);
    return;
  }
  const double deviation = kAcrossDeviation_mm * std::sqrt(kPointsThatAgree / difference_squared);
  if (points < kFewestPoints || !(deviation < kTellingDeviation)) return;
  share_ = common / difference_squared;
  pushing_frames_ = *share_ < kMostPushingShare ? pushing_frames_ + 1 : 0;
  grasping_frames_ = *share_ > kLeastGraspingShare ? grasping_frames_ + 1 : 0;
  if (pushing_frames_ >= kFramesToTell) grip_ = Grip::push;
  if (grasping_frames_ >= kFramesToTell) grip_ = Grip::grasp;
}

}  // namespace palpate
