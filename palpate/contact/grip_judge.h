#pragma once

#include <vector>

#include "palpate/contact/contact_options.h"
#include "palpate/contact/tissue_motion.h"

namespace palpate {

/// What one frame says about two predictions of how the tissue moves.
struct Leaning {
  double share = 0.5;                ///< least-squares place of the seen motion between them: 0 = first, 1 = second
  double deviation = kKnowsNothing;  ///< one standard deviation of it
  static constexpr double kKnowsNothing = 1e6;
};

/// `first_mm`, `second_mm`: motion that each predicts at the rest position of each point.
Leaning lean(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& first_mm,
             const std::vector<Vec3>& second_mm);

/// Tells how a tip holds the tissue, by what happens: a tip that presses and slides over the tissue pushes, one that
/// takes the tissue along grasps it. Until then both give nearly the same force. A sequential probability ratio test
/// (Wald 1945) over the frames of one contact: once told, it stays.
class GripJudge {
 public:
  /// Begins a contact. Anything but `automatic` is known from the start.
  void start(Grip grip);

  /// A frame in which the two differ: motion of the tissue if the tip only pushes, and if it holds.
  void update(const std::vector<TissuePoint>& seen, const std::vector<Vec3>& pushed_mm,
              const std::vector<Vec3>& grasped_mm);

  /// `automatic` as long as it cannot be told.
  Grip grip() const { return grip_; }
  /// What speaks for a grasp so far, in natural logarithms of the odds; negative speaks for a push.
  double evidence() const { return evidence_; }

 private:
  Grip grip_ = Grip::automatic;
  double evidence_ = 0;
};

}  // namespace palpate
