#pragma once

#include <Eigen/Core>
#include <vector>

#include "palpate/infer/inference_parameters.h"
#include "palpate/infer/scene_motion.h"

namespace palpate {

/// Where each unknown of the estimate stands in its vector: the scene's translation, rotation and strain and the
/// stereo's common disparity bias, then for each contact q, offset, log radius and skew (common error of the model's
/// motion of the tissue: it moves as if the patch were displaced by q + |q| skew).
struct Unknowns {
  static constexpr Eigen::Index kTranslation = 0, kRotation = 3, kStrain = 6, kBias = 9, kScene = 10, kContact = 10;
  static Eigen::Index q(size_t contact) { return kScene + kContact * static_cast<Eigen::Index>(contact); }
  static Eigen::Index offset(size_t contact) { return q(contact) + 3; }
  static Eigen::Index log_radius(size_t contact) { return q(contact) + 6; }
  static Eigen::Index skew(size_t contact) { return q(contact) + 7; }
  static Eigen::Index count(size_t contacts) { return q(contacts); }
};

/// A Gaussian over the unknowns.
struct Belief {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;

  size_t contacts() const { return static_cast<size_t>((mean.size() - Unknowns::kScene) / Unknowns::kContact); }
  Vec3 q_mm(size_t contact) const { return mean.segment<3>(Unknowns::q(contact)); }
  Vec3 offset_mm(size_t contact) const { return mean.segment<3>(Unknowns::offset(contact)); }
  double log_radius(size_t contact) const { return mean[Unknowns::log_radius(contact)]; }
  Vec3 skew(size_t contact) const { return mean.segment<3>(Unknowns::skew(contact)); }
  SceneMotion scene(const Vec3& about_mm) const;
};

/// Nothing touches, nothing has moved.
Belief initial_belief(const InferenceParameters& parameters);

/// After `seconds`: fast unknowns walk far, slow ones (offset, radius, skew) hardly.
Belief predict(const Belief& belief, double seconds, const InferenceParameters& parameters);

/// One more contact at the end, with these means and deviations, independent of the rest; its skew is 0.
struct ContactPrior {
  Vec3 q_mm = Vec3::Zero(), offset_mm = Vec3::Zero();
  Mat3 q_covariance_mm2 = Mat3::Identity(), offset_covariance_mm2 = Mat3::Identity();
  double log_radius = 0, log_radius_deviation = 1, skew_deviation = 0.15;
};
Belief with_contact(const Belief& belief, const ContactPrior& prior);
/// The rest of it, whatever this contact's unknowns are.
Belief without_contact(const Belief& belief, size_t contact);

/// Some unknowns of `now` as they were believed `before`: what a frame said of them is not learned. What the others owe
/// to them stays (Schmidt's filter, which considers parameters that it does not estimate). Beliefs of another size stay
/// as they are.
void forget(const Belief& before, Eigen::Index at, Eigen::Index count, Belief& now);

/// One unknown known otherwise: what is believed of the others, given that one, stays (Jeffrey's rule).
void with_marginal(Eigen::Index at, double mean, double variance, Belief& belief);

}  // namespace palpate
