#include "palpate/infer/hold_filter.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// No hypothesis is ever ruled out for good.
constexpr double kMinProbability = 1e-6;

double& at(ByHold& values, Hold hold) {
  return values[static_cast<size_t>(hold)];
}

}  // namespace

std::string hold_name(Hold hold) {
  constexpr const char* kNames[] = {"free", "grasp", "push", "slide"};
  return kNames[static_cast<size_t>(hold)];
}

HoldFilter::HoldFilter(Grip grip) : grip_(grip), probability_{1, 0, 0, 0} {}

bool HoldFilter::allows(Hold hold) const {
  if (grip_ == Grip::grasp) return hold == Hold::free || hold == Hold::grasp;
  if (grip_ == Grip::push) return hold != Hold::grasp;
  return true;
}

void HoldFilter::predict(double seconds, const InferenceParameters& parameters) {
  const auto changed = [seconds](double per_s) { return 1 - std::exp(-per_s * seconds); };
  const double released = changed(parameters.release_per_s), slips = changed(parameters.slip_per_s),
               sticks = changed(parameters.stick_per_s);
  ByHold next = probability_;
  for (Hold hold : {Hold::grasp, Hold::push, Hold::slide}) {
    at(next, Hold::free) += released * at(probability_, hold);
    at(next, hold) -= released * at(probability_, hold);
  }
  const double touched = changed(parameters.hold_again_per_s) * probability(Hold::free);
  at(next, Hold::free) -= touched;
  if (grip_ != Grip::push) at(next, Hold::grasp) += grip_ == Grip::grasp ? touched : 0.5 * touched;
  if (grip_ != Grip::grasp) at(next, Hold::push) += grip_ == Grip::push ? touched : 0.5 * touched;
  const double to_slide = slips * at(next, Hold::push), to_push = sticks * at(next, Hold::slide);
  at(next, Hold::push) += to_push - to_slide;
  at(next, Hold::slide) += to_slide - to_push;
  probability_ = next;
}

void HoldFilter::update(const ByHold& log_likelihood) {
  double max = -INFINITY;
  for (size_t h = 0; h < kHolds; ++h)
    if (allows(static_cast<Hold>(h))) max = std::max(max, log_likelihood[h]);
  double sum = 0;
  for (size_t h = 0; h < kHolds; ++h) {
    const bool allowed = allows(static_cast<Hold>(h));
    const double prior = allowed ? std::max(probability_[h], kMinProbability) : 0;
    probability_[h] = allowed ? prior * std::exp(log_likelihood[h] - max) : 0;
    sum += probability_[h];
  }
  for (double& p : probability_) p /= sum;
}

void HoldFilter::touch(double probability) {
  probability_ = {1 - probability, 0, 0, 0};
  if (grip_ == Grip::grasp) {
    at(probability_, Hold::grasp) = probability;
  } else if (grip_ == Grip::push) {
    at(probability_, Hold::push) = probability;
  } else {
    at(probability_, Hold::grasp) = at(probability_, Hold::push) = 0.5 * probability;
  }
}

void HoldFilter::release() {
  probability_ = {1, 0, 0, 0};
}

Hold HoldFilter::most_probable() const {
  if (probability(Hold::free) > 0.5) return Hold::free;
  const double grasp = probability(Hold::grasp), push = probability(Hold::push), slide = probability(Hold::slide);
  if (slide > std::max(grasp, push)) return Hold::slide;
  constexpr double kTold = 2;  // ratio of probabilities that changes the answer
  if (last_grip_ == Hold::grasp && push > kTold * grasp) last_grip_ = Hold::push;
  if (last_grip_ == Hold::push && grasp > kTold * push) last_grip_ = Hold::grasp;
  return last_grip_;
}

}  // namespace palpate
