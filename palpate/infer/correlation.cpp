#include "palpate/infer/correlation.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "palpate/infer/contact_fit.h"

namespace palpate {

ForceCorrelation force_correlation(const ForceAt& force, const Belief& posterior, size_t contact) {
  const double magnitude_N = force.force_N.norm();
  if (magnitude_N == 0) return {};
  const Eigen::VectorXd gradient = force.per_unknown.transpose() * force.force_N / magnitude_N;
  const Eigen::VectorXd with_unknowns = posterior.covariance * gradient;
  const double variance_N2 = gradient.dot(with_unknowns);
  if (!(variance_N2 > 0)) return {};
  const auto with = [&](Eigen::Index at, Eigen::Index count) {
    const Eigen::VectorXd c = with_unknowns.segment(at, count);
    const double explained_N2 = c.dot(posterior.covariance.block(at, at, count, count).ldlt().solve(c));
    return std::sqrt(std::clamp(explained_N2 / variance_N2, 0.0, 1.0));
  };
  return {with(Unknowns::kTranslation, 9), with(Unknowns::kBias, 1), with(Unknowns::offset(contact), 3),
          with(Unknowns::log_radius(contact), 1), with(Unknowns::skew(contact), 3)};
}

}  // namespace palpate
