#pragma once

#include "palpate/stereo/rig.h"

namespace palpate {

/// Throws BadInput where this can be no pair of cameras: focal length, number of coefficients, R no rotation, baseline
/// outside 1-200 mm, cameras exchanged or not side by side.
void check_rig(const StereoRig& rig);

}  // namespace palpate
