#pragma once

#include <memory>

#include "palpate/core/geometry.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// One point of the tissue followed in both images since a reference frame; left camera frame.
struct TissuePoint {
  int number = 0;                       ///< the same for the same point in every frame since the reference
  Vec3 rest_mm = Vec3::Zero();          ///< where it was in the reference frame
  Vec3 displacement_mm = Vec3::Zero();  ///< since then
  double deviation_mm = 0;              ///< one standard deviation of the displacement along the viewing ray
};

/// Follows the organ's texture around a contact from the reference frame (Lucas-Kanade against the reference image, not
/// frame to frame, so that it does not drift), left and right.
class TissueMotion {
 public:
  explicit TissueMotion(const Rectification& rectification);
  ~TissueMotion();
  TissueMotion(TissueMotion&&) noexcept;

  /// Picks corners in a ring of `outer_radius_mm` around `center_mm`, outside the instrument mask.
  void start(const RectifiedPair& reference, const cv::Mat& instrument_mask, const Vec3& center_mm,
             double outer_radius_mm);
  void stop();
  bool active() const;

  /// The points that are still seen (forward-backward check, epipolar check, not under the instrument).
  std::vector<TissuePoint> update(const RectifiedPair& pair, const cv::Mat& left_instrument_mask,
                                  const cv::Mat& right_instrument_mask);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
