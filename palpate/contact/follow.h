#pragma once

#include "palpate/contact/tissue_motion.h"
#include "palpate/core/geometry.h"

namespace palpate {

/// What the image says about a contact: does the tissue move as the held model predicts?
struct Follow {
  int points = 0;           ///< tissue points compared
  double share = 1;         ///< least-squares factor from predicted to seen motion: 1 = follows, 0 = stays at rest
  double predicted_mm = 0;  ///< RMS of the predicted motion at these points
  double misfit_mm = 0;     ///< median distance between predicted and seen motion
  bool let_go = false;      ///< the prediction is large enough to tell, and the tissue does not follow it
};

/// `predicted_mm`: motion of the model at the rest position of each point.
Follow compare_motion(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& predicted_mm);

}  // namespace palpate
