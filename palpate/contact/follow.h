#pragma once

#include <deque>
#include <map>

#include "palpate/contact/tissue_motion.h"
#include "palpate/core/geometry.h"

namespace palpate {

/// What the image says about a contact: does the tissue move as the held model predicts?
struct Follow {
  int points = 0;           ///< tissue points compared
  double share = 1;         ///< least-squares factor from predicted to seen motion: 1 = follows, 0 = stays at rest
  double predicted_mm = 0;  ///< RMS of the predicted motion at these points
  double misfit_mm = 0;     ///< median distance between predicted and seen motion
  double seen_mm = 0;       ///< median of the seen motion, across the viewing ray
  bool let_go = false;      ///< the prediction is large enough to tell, and the tissue does not follow it
};

/// `predicted_mm`: motion of the model at the rest position of each point.
Follow compare_motion(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& predicted_mm);

/// Sees a tip let go by the last few frames alone, whatever happened since onset: the tip moves, and the tissue, which
/// was to come along, stays. Only motion across the viewing ray counts; it is known to a hundredth of a millimetre.
class ReleaseDetector {
 public:
  void start() { frames_.clear(); }

  /// Every frame of a contact: where the tip is, the rest as of compare_motion. True in the frame that shows the
  /// release.
  bool update(const Vec3& tip_mm, const std::vector<TissuePoint>& seen, const std::vector<Vec3>& predicted_mm);

 private:
  struct Motion {
    Vec3 seen_mm;
    Vec3 predicted_mm;
  };
  struct Frame {
    Vec3 tip_mm;
    std::map<int, Motion> points;  ///< by number
  };
  std::deque<Frame> frames_;  ///< the last ones
};

}  // namespace palpate
