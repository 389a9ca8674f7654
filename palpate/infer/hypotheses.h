#pragma once

#include <array>
#include <string>

#include "palpate/contact/contact_options.h"
#include "palpate/core/geometry.h"
#include "palpate/infer/inference_parameters.h"

namespace palpate {

/// What a tip does to the tissue.
enum class Hold { free, grasp, push, slide };
inline constexpr size_t kHolds = 4;

/// "free", "grasp", "push", "slide": the column grip of forces.csv.
std::string hold_name(Hold hold);

/// One value for each Hold, in its order.
using ByHold = std::array<double, kHolds>;

/// A hidden Markov model of one tip: how probable each hypothesis is, filtered over time.
class HoldFilter {
 public:
  explicit HoldFilter(Grip grip);

  /// Time passes near a place that may be held: hypotheses change into each other at their rates.
  void predict(double seconds, const InferenceParameters& parameters);
  /// A frame's log marginal likelihoods, all of the same data.
  void update(const ByHold& log_likelihood);
  /// The tip has touched with this probability; which grip it is keeps open.
  void touch(double probability);
  void release();

  double probability(Hold hold) const { return probability_[static_cast<size_t>(hold)]; }
  double p_contact() const { return 1 - probability(Hold::free); }
  /// The most probable one; grasp and push that cannot be told apart keep the last answer.
  Hold most_probable() const;
  bool allows(Hold hold) const;

 private:
  Grip grip_;
  ByHold probability_;
  mutable Hold last_grip_ = Hold::grasp;
};

/// A free tip near the surface, in the map frame.
struct FreeTip {
  double gap_mm = 0;            ///< signed distance to the surface, positive outside
  double gap_deviation_mm = 0;  ///< one standard deviation
  Vec3 step_mm = Vec3::Zero();  ///< since the last frame, against the tissue
  Mat3 step_covariance_mm2 = Mat3::Zero();
};

/// log of p(tip | it has just touched) / p(tip | it is free), and whether the touch went unnoticed before (the tip is
/// inside already).
struct TouchEvidence {
  double log_ratio = 0;
  bool unnoticed = false;
};
TouchEvidence touch_evidence(const FreeTip& tip, double seconds, const InferenceParameters& parameters);

/// log probability that a force (N, with covariance) lies in Coulomb's cone about the inward normal, against that of no
/// force at all; never above 0. `friction_error`: deviation of the coefficient, ratio to it.
double log_in_friction_cone(const Vec3& force_N, const Mat3& covariance_N2, const Vec3& outward_normal, double friction,
                            double friction_error);

/// Normal density around 0, its logarithm.
double log_normal(const Vec3& x, const Mat3& covariance);
/// Standard normal distribution function, its logarithm.
double log_normal_cdf(double x);

}  // namespace palpate
