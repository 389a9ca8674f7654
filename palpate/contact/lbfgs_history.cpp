#include "palpate/contact/lbfgs_history.h"

#include <vector>

namespace palpate {

namespace {
constexpr size_t kMaxPairs = 8;
constexpr double kMinCurvature = 1e-8;
}  // namespace

void LbfgsHistory::add(const Eigen::VectorXd& s, const Eigen::VectorXd& y) {
  const double sy = s.dot(y);
  if (sy <= kMinCurvature * s.norm() * y.norm()) return;
  if (pairs_.size() == kMaxPairs) pairs_.pop_front();
  pairs_.push_back({s, y, 1 / sy});
}

Eigen::VectorXd LbfgsHistory::step(const BorderedSystem& system, const Eigen::VectorXd& unbalanced) const {
  Eigen::VectorXd q = unbalanced;
  std::vector<double> alpha(pairs_.size());
  for (size_t i = pairs_.size(); i-- > 0;) {
    alpha[i] = pairs_[i].inverse_sy * pairs_[i].s.dot(q);
    q -= alpha[i] * pairs_[i].y;
  }
  Eigen::VectorXd du = system.solve(q, Eigen::VectorXd::Zero(system.constraint_count())).du;
  for (size_t i = 0; i < pairs_.size(); ++i)
    du -= (alpha[i] + pairs_[i].inverse_sy * pairs_[i].y.dot(du)) * pairs_[i].s;
  return du;
}

}  // namespace palpate
