#include "palpate/contact/follow.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {
constexpr int kFewestPoints = 6;
/// Motion below this cannot be told from noise at endoscopic baselines.
constexpr double kLeastTellingMotion_mm = 0.15;
constexpr double kLeastFollowingShare = 0.35;
}  // namespace

Follow compare_motion(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& predicted_mm) {
  Follow follow;
  follow.points = static_cast<int>(seen.size());
  if (seen.empty()) return follow;
  // Along the viewing ray a displacement is known far worse than across it: weigh both by their deviation.
  double predicted_seen = 0, predicted_predicted = 0, sum_of_squares = 0;
  std::vector<double> misfit;
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
    misfit.push_back((p - s - (1 - along_weight) * ray.dot(p - s) * ray).norm());
  }
  follow.predicted_mm = std::sqrt(sum_of_squares / static_cast<double>(seen.size()));
  if (predicted_predicted > 0) follow.share = predicted_seen / predicted_predicted;
  std::nth_element(misfit.begin(), misfit.begin() + static_cast<std::ptrdiff_t>(misfit.size() / 2), misfit.end());
  follow.misfit_mm = misfit[misfit.size() / 2];
  follow.let_go = follow.points >= kFewestPoints && follow.predicted_mm > kLeastTellingMotion_mm &&
                  follow.share < kLeastFollowingShare;
  return follow;
}

}  // namespace palpate
