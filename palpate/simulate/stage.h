#pragma once

#include "palpate/simulate/render.h"
#include "palpate/simulate/truth_motion.h"

namespace palpate {

/// The surfaces that are drawn: organ, the wall of the cavity behind it, instruments, gauze.
class Stage {
 public:
  /// `organ` at rest; the instruments as in the `first` moment. Throws BadInput when a picture that the look is taken
  /// from cannot be read.
  Stage(const SimulateOptions& options, const Surface& organ, const TruthBody& truth, const Moment& first);

  /// 255 where the left camera sees the organ before all others.
  cv::Mat organ_mask() { return renderer_.visible_mask(organ_number_); }

  /// Puts everything in place.
  void show(const Moment& moment);
  /// Light of what is shown; see Renderer::light.
  StereoLight light(int index, double time_s) { return renderer_.light(index, time_s); }
  /// The organ as it is shown, left camera frame.
  const Surface& shown_organ() const { return shown_organ_; }

 private:
  SimulateOptions options_;
  Texture tissue_;
  Surface organ_, wall_, gauze_, shown_organ_;
  Vec3 shown_scene_mm_ = Vec3::Zero();
  Skin skin_;
  Renderer renderer_;
  int organ_number_ = 0, wall_number_ = 0, instrument_number_ = 0, second_instrument_number_ = -1, gauze_number_ = -1;
};

}  // namespace palpate
