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
/// Stiffness, depth and friction are not known better than this share of the difference, however well it is seen.
constexpr double kModelDeviation = 0.25;
/// Odds of e^8 = 3000: two frames that speak clearly.
constexpr double kCertain = 8;

}  // namespace

Leaning lean(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& first_mm,
             const std::vector<Vec3>& second_mm) {
  if (static_cast<int>(seen.size()) < kFewestPoints) return {};
  double along_difference = 0, difference_squared = 0;
  for (size_t i = 0; i < seen.size(); ++i) {
    const Vec3 ray = seen[i].rest_mm.normalized();
    const double along_weight = std::pow(kAcrossDeviation_mm / std::max(seen[i].deviation_mm, kAcrossDeviation_mm), 2);
    const Vec3 difference = second_mm[i] - first_mm[i];
    const Vec3 weighted = difference - (1 - along_weight) * difference.dot(ray) * ray;
    along_difference += weighted.dot(seen[i].displacement_mm - first_mm[i]);
    difference_squared += weighted.dot(difference);
  }
  if (!(difference_squared > 0)) return {};
  const double noise = kAcrossDeviation_mm * std::sqrt(kPointsThatAgree / difference_squared);
  return {along_difference / difference_squared, std::hypot(noise, kModelDeviation)};
}

void GripJudge::start(Grip grip) {
  grip_ = grip;
  evidence_ = 0;
}

void GripJudge::update(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& pushed_mm,
                       const std::vector<Vec3>& grasped_mm) {
  if (grip_ != Grip::automatic) return;
  const Leaning leaning = lean(seen, pushed_mm, grasped_mm);
  const double share = std::clamp(leaning.share, 0.0, 1.0);
  evidence_ += (share - 0.5) / (leaning.deviation * leaning.deviation);
  if (evidence_ > kCertain) grip_ = Grip::grasp;
  if (evidence_ < -kCertain) grip_ = Grip::push;
}

}  // namespace palpate
