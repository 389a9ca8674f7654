#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "palpate/core/settings.h"

namespace palpate {

enum class Grip { automatic, grasp, push };

/// What drives the model: tip and tissue in one estimate, or the tip alone as in the paper.
enum class Drive { fused, tip };

/// `contact` of the scene file.
struct ContactOptions {
  double threshold_mm = 1.5;         ///< T of Eq. 4: nearer than this, the contact is armed
  double footprint_radius_mm = 2.0;  ///< of the patch of tissue that the tip holds
  Grip grip = Grip::automatic;
  double friction = 0.3;  ///< Coulomb coefficient of a push
  Drive drive = Drive::fused;
  /// Where tissue is held when no instrument is looked for, recorded left image; empty or one pixel.
  std::vector<cv::Point2d> at_px;
  int at_frame = -1;  ///< from which frame on; -1 = when the tissue says so
};

void describe(Settings& settings, ContactOptions& options);

}  // namespace palpate
