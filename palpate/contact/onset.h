#pragma once

#include <deque>

#include "palpate/core/geometry.h"

namespace palpate {

/// Decides when a free tip begins to touch (Eq. 4 with hysteresis): armed within the threshold of the surface, the
/// contact begins when the gap has closed within the tip's deviation, or when an approaching tip comes to rest there.
class OnsetDetector {
 public:
  explicit OnsetDetector(double threshold_mm) : threshold_mm_(threshold_mm) {}

  /// `gap_mm`: signed distance of the tip to the deformed surface; `gap_deviation_mm`: one standard deviation of it;
  /// `tip_mm`: for the tip's speed. True in the frame in which the contact begins.
  bool update(double gap_mm, double gap_deviation_mm, const Vec3& tip_mm);

  bool armed() const { return armed_; }
  /// Forgets the approach (the tip was lost, or has let go).
  void reset();

 private:
  double threshold_mm_;
  bool armed_ = false;
  bool has_left_ = true;  // after a release the tip has to leave the surface before it can touch again
  std::deque<Vec3> recent_tips_;
};

}  // namespace palpate
