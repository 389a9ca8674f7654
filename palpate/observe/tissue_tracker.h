#pragma once

#include <memory>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// A point of the tissue seen in both cameras. It is known by its place in the map frame, so that nothing drifts.
struct TissuePoint {
  int number = 0;                 ///< the same point in every frame
  Vec3 rest_mm = Vec3::Zero();    ///< where it lies in the map frame, left camera frame
  Vec3 motion_px = Vec3::Zero();  ///< left x, left y and disparity of the rectified pair, now minus in the map frame
  double noise = 1;               ///< of the motion, over that of a point that looks as in the map frame
  double model_mm = 0;            ///< min. error with which a model is believed to move it
};

struct TissueTrackerParameters {
  int points = 800;                ///< that may be followed, over the whole organ
  double spacing_px = 7;           ///< between two of them
  double min_correlation = 0.8;    ///< of the window now with the window in the map frame
  double good_correlation = 0.97;  ///< from here on a point has no more noise than the sensor makes
  double max_row_change_px = 1.0;  ///< of right minus left row, against the map frame
};

/// Follows the texture of the whole organ: pyramidal Lucas-Kanade of both cameras against the map frame, never from
/// frame to frame.
class TissueTracker {
 public:
  /// `reference`: the rectified pair of the map frame; `disparity_px`: CV_32F, NaN where nothing was matched;
  /// `usable`: 255 = tissue of the left image that may be followed.
  TissueTracker(const RectifiedPair& reference, const Rectification& rectification, const cv::Mat& disparity_px,
                const cv::Mat& usable, const TissueTrackerParameters& parameters = {});
  ~TissueTracker();
  TissueTracker(TissueTracker&&) noexcept;

  /// Every point that may be seen, with `motion_px` zero.
  const std::vector<TissuePoint>& points() const;

  /// Those of the wanted points that are seen in this pair. `wanted`: their numbers, with `motion_px` as expected:
  /// there the search begins. Masks: 255 = instrument; may be empty.
  std::vector<TissuePoint> update(const RectifiedPair& pair, const cv::Mat& left_instrument,
                                  const cv::Mat& right_instrument, const std::vector<TissuePoint>& wanted) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace palpate
