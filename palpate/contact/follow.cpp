#include "palpate/contact/follow.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {
constexpr int kFewestPoints = 6;
/// Motion below this cannot be told from noise at endoscopic baselines.
constexpr double kLeastTellingMotion_mm = 0.15;
constexpr double kLeastFollowingShare = 0.35;

/// Of the release detector: frames looked back; step of the tip across the ray that tells; the part of the tip's step
/// that lies across the ray at least: the depth of the tip jitters, and the model turns some of that into motion across
/// the ray; the share of the predicted step that held tissue shows at least: one standard deviation more is less.
constexpr size_t kFramesBack = 3;
constexpr double kLeastTipStep_mm = 0.12;
constexpr double kLeastAcrossShare = 0.5;
constexpr double kLeastFollowingStepShare = 0.25;
/// Of the step of a tracked point across the ray; so many neighbours share their errors.
constexpr double kStepDeviation_mm = 0.05;
constexpr double kPointsThatAgree = 6;

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Vec3 across(const Vec3& motion, const Vec3& at) {
  const Vec3 ray = at.normalized();
  return motion - motion.dot(ray) * ray;
}
}  // namespace

Follow compare_motion(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& predicted_mm) {
  Follow follow;
  follow.points = static_cast<int>(seen.size());
  if (seen.empty()) return follow;
  // Along the viewing ray a displacement is known far worse than across it: weigh both by their deviation.
  double predicted_seen = 0, predicted_predicted = 0, sum_of_squares = 0;
  std::vector<double> misfit, motion;
  for (size_t i = 0; i < seen.size(); ++i) {
    constexpr double kAcrossDeviation_mm = 0.05;
    const Vec3 ray = seen[i].rest_mm.normalized();
    const double along_weight = std::pow(kAcrossDeviation_mm / std::max(seen[i].deviation_mm, kAcrossDeviation_mm), 2);
    const Vec3& p = predicted_mm[i];
    const Vec3& s = seen[i].displacement_mm;
    const double p_along = p.dot(ray), s_along = s.dot(ray);
    predicted_seen += p.dot(s) - (1 - along_weight) * p_along * s_along;
    const double p_squared = p.squaredNorm() - (1 - along_weight) * p_along * p_along;
    predicted_predicted += p_squared;
    sum_of_squares += p_squared;
    motion.push_back(across(s, seen[i].rest_mm).norm());
    misfit.push_back((p - s - (1 - along_weight) * ray.dot(p - s) * ray).norm());
  }
  follow.predicted_mm = std::sqrt(sum_of_squares / static_cast<double>(seen.size()));
  if (predicted_predicted > 0) follow.share = predicted_seen / predicted_predicted;
  follow.misfit_mm = median_of(misfit);
  follow.seen_mm = median_of(motion);
  follow.let_go = follow.points >= kFewestPoints && follow.predicted_mm > kLeastTellingMotion_mm &&
                  follow.share < kLeastFollowingShare;
  return follow;
}

bool ReleaseDetector::update(const Vec3& tip_mm, const std::vector<TissuePoint>& seen,
                             const std::vector<Vec3>& predicted_mm) {
  std::map<int, Motion> now;
  for (size_t i = 0; i < seen.size(); ++i)
    now[seen[i].number] = {across(seen[i].displacement_mm, seen[i].rest_mm), across(predicted_mm[i], seen[i].rest_mm)};
  bool let_go = false;
  for (size_t back = 1; back <= frames_.size(); ++back) {
    const auto& [tip_before_mm, before] = frames_[frames_.size() - back];
    const Vec3 tip_step = tip_mm - tip_before_mm;
    const double tip_across_mm = across(tip_step, tip_mm).norm();
    if (tip_across_mm < std::max(kLeastTipStep_mm, kLeastAcrossShare * tip_step.norm())) continue;
    int points = 0;
    double seen_predicted = 0, predicted_squared = 0;
    for (const auto& [number, motion] : now) {
      const auto found = before.find(number);
      if (found == before.end()) continue;
      const Vec3 step = motion.predicted_mm - found->second.predicted_mm;
      seen_predicted += step.dot(motion.seen_mm - found->second.seen_mm);
      predicted_squared += step.squaredNorm();
      ++points;
    }
    const double deviation = kStepDeviation_mm * std::sqrt(kPointsThatAgree / predicted_squared);
    // Tissue that goes the other way has not been let go in this step: a law that gives way predicts that.
    let_go |=
        points >= kFewestPoints && std::abs(seen_predicted) / predicted_squared + deviation < kLeastFollowingStepShare;
  }
  frames_.push_back({tip_mm, std::move(now)});
  if (frames_.size() > kFramesBack) frames_.pop_front();
  return let_go;
}

}  // namespace palpate
