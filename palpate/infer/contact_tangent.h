#pragma once

#include "palpate/core/geometry.h"

namespace palpate {

/// How the force follows the tip near a frame's answer, left camera frame: what answers between the frames.
struct ContactTangent {
  Mat3 stiffness_N_per_mm = Mat3::Zero();  ///< dF/dp
  Vec3 displacement_mm = Vec3::Zero();     ///< p, of the patch from its place at rest
  Vec3 normal = Vec3::UnitZ();             ///< outward, of the surface at rest where the patch is
};

}  // namespace palpate
