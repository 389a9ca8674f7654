#pragma once

#include <memory>

#include "palpate/contact/contact_options.h"
#include "palpate/estimate/force_estimate.h"
#include "palpate/estimate/force_uncertainty.h"
#include "palpate/estimate/tissue_map.h"
#include "palpate/infer/inference_parameters.h"
#include "palpate/instrument/instrument_tracker.h"

namespace palpate {

/// COMPUTE, the second stage: every frame from two images to a force. Keeps the map, the trackers and what is believed
/// between frames.
class ForceEstimator {
 public:
  /// `static_frame`: the frame that the map was built from; `uncertainty`: of the tissue, for the total band.
  ForceEstimator(TissueMap map, const StereoFrame& static_frame, const Rectification& rectification,
                 const InstrumentOptions& instrument, const ContactOptions& contact,
                 const InferenceParameters& tuning = {}, ForceUncertainty uncertainty = {});
  ~ForceEstimator();
  ForceEstimator(ForceEstimator&&) noexcept;

  /// Frames in order of time. Never throws for a bad frame: the status says what happened.
  ForceEstimate update(const StereoFrame& frame);

  const TissueMap& map() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
