#pragma once

#include <array>
#include <string>

#include "palpate/contact/contact_options.h"
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

}  // namespace palpate
