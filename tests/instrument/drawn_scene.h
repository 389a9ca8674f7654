#pragma once

#include <vector>

#include "palpate/stereo/rig.h"

namespace palpate::test {

/// A grey round grasper: a shaft of `radius_mm` whose last `jaw_mm` taper towards the tip. Left camera frame.
struct DrawnInstrument {
  Vec3 tip_mm = {0, 0, 85};
  Vec3 direction = Vec3(-0.8, -0.2, 0.5).normalized();  ///< from the shaft towards the tip
  double radius_mm = 3;
  double tip_radius_mm = 0.8;
  double jaw_mm = 14;
};

/// What a drawn scene shows besides reddish textured tissue 90 mm away.
struct DrawnScene {
  bool instrument = true;
  bool highlights = false;  ///< white discs on the tissue
  double highlight_shift_px = 0;
  unsigned noise_seed = 1;
};

/// 640x360, focal length 500 px, baseline 5 mm, already rectified.
Rectification drawn_rectification();

RectifiedPair draw_pair(const DrawnScene& scene, const DrawnInstrument& instrument, int index);

/// Several instruments, the nearer before the farther.
RectifiedPair draw_pair_of(const std::vector<DrawnInstrument>& instruments, const DrawnScene& scene, int index);

/// 255 where the left camera sees the instrument, by ray casting.
cv::Mat drawn_mask(const DrawnInstrument& instrument, double camera_mm = 0);

}  // namespace palpate::test
