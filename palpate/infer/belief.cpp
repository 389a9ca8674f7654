#include "palpate/infer/belief.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace palpate {

SceneMotion Belief::scene(const Vec3& about_mm) const {
  return {mean.segment<3>(Unknowns::kTranslation), mean.segment<3>(Unknowns::kRotation), about_mm,
          mean.segment<3>(Unknowns::kStrain)};
}

Belief initial_belief(const InferenceParameters& parameters) {
  Belief belief;
  belief.mean = Eigen::VectorXd::Zero(Unknowns::kScene);
  Eigen::VectorXd deviation(Unknowns::kScene);
  // The map frame itself: nothing has moved yet.
  constexpr double kStill = 0.01;
  deviation << Vec3::Constant(kStill * parameters.scene_mm), Vec3::Constant(kStill * parameters.scene_rad),
      Vec3::Constant(kStill * parameters.scene_strain), parameters.disparity_bias_px;
  belief.covariance = deviation.cwiseAbs2().asDiagonal();
  return belief;
}

namespace {

/// A walk within a proper prior: the mean is drawn back, the variance grows towards the prior's.
void walk(Belief& belief, Eigen::Index at, Eigen::Index count, double prior, double walk_per_sqrt_s, double seconds) {
  const double variance = prior * prior, added = walk_per_sqrt_s * walk_per_sqrt_s * seconds;
  const double kept = std::sqrt(std::max(0.0, 1 - added / variance));
  belief.mean.segment(at, count) *= kept;
  belief.covariance.middleRows(at, count) *= kept;
  belief.covariance.middleCols(at, count) *= kept;
  belief.covariance.diagonal().segment(at, count).array() += std::min(added, variance);
}

}  // namespace

Belief predict(const Belief& belief, double seconds, const InferenceParameters& parameters) {
  Belief next = belief;
  walk(next, Unknowns::kTranslation, 3, parameters.scene_mm, parameters.scene_walk_mm, seconds);
  walk(next, Unknowns::kRotation, 3, parameters.scene_rad, parameters.scene_walk_rad, seconds);
  walk(next, Unknowns::kStrain, 3, parameters.scene_strain, parameters.scene_walk_strain, seconds);
  walk(next, Unknowns::kBias, 1, parameters.disparity_bias_px, 1e3, seconds);
  const double step_mm = parameters.hand_mm_per_s * seconds;
  auto variance = next.covariance.diagonal();
  for (size_t i = 0; i < belief.contacts(); ++i) {
    variance.segment<3>(Unknowns::q(i)).array() += step_mm * step_mm;
    variance.segment<3>(Unknowns::offset(i)).array() += std::pow(parameters.offset_walk_mm, 2) * seconds;
    variance[Unknowns::log_radius(i)] += std::pow(parameters.log_radius_walk, 2) * seconds;
  }
  return next;
}

Belief with_contact(const Belief& belief, const ContactPrior& prior) {
  const Eigen::Index before = belief.mean.size(), after = before + Unknowns::kContact;
  Belief next;
  next.mean = Eigen::VectorXd::Zero(after);
  next.mean << belief.mean, prior.q_mm, prior.offset_mm, prior.log_radius, Vec3::Zero();
  next.covariance = Eigen::MatrixXd::Zero(after, after);
  next.covariance.topLeftCorner(before, before) = belief.covariance;
  next.covariance.block<3, 3>(before, before) = prior.q_covariance_mm2;
  next.covariance.block<3, 3>(before + 3, before + 3) = prior.offset_covariance_mm2;
  next.covariance(before + 6, before + 6) = prior.log_radius_deviation * prior.log_radius_deviation;
  next.covariance.block<3, 3>(before + 7, before + 7) = prior.skew_deviation * prior.skew_deviation * Mat3::Identity();
  return next;
}

Belief without_contact(const Belief& belief, size_t contact) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < belief.mean.size(); ++i)
    if (i < Unknowns::q(contact) || i >= Unknowns::q(contact + 1)) kept.push_back(i);
  return {belief.mean(kept), belief.covariance(kept, kept)};
}

void forget(const Belief& before, Eigen::Index at, Eigen::Index count, Belief& now) {
  if (before.mean.size() != now.mean.size()) return;
  now.mean.segment(at, count) = before.mean.segment(at, count);
  now.covariance.block(at, at, count, count) = before.covariance.block(at, at, count, count);
}

void with_marginal(Eigen::Index at, double mean, double variance, Belief& belief) {
  const double before = belief.covariance(at, at);
  const Eigen::VectorXd per_unit = belief.covariance.col(at) / before;
  belief.mean += per_unit * (mean - belief.mean[at]);
  belief.covariance += (variance - before) * per_unit * per_unit.transpose();
}

}  // namespace palpate
