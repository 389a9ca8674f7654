#pragma once

#include <optional>

#include "palpate/instrument/instrument_plane.h"
#include "palpate/stereo/rig.h"

namespace palpate {

/// The instrument as both cameras saw it in one frame, the template against which its later motion is measured.
struct InstrumentKeyframe {
  PatchTemplate left;
  PatchTemplate right;
  InstrumentPlane plane;
  Vec3 tip_mm = Vec3::Zero();  ///< in the rectified frame
};

/// Motion of the rigid instrument since a keyframe, rectified frame.
struct RigidMotion {
  Vec3 translation_mm = Vec3::Zero();  ///< of the tip
  Vec3 rotation_rad = Vec3::Zero();    ///< about the tip
  Mat3 covariance_mm2 = Mat3::Zero();  ///< of the translation
  double agreement = 0;                ///< fraction of the keyframe's gradients that fit, 0..1
};

/// Lucas-Kanade of all cells of the keyframe in both cameras at once for the six numbers of a rigid motion, coarse to
/// fine; always against the keyframe, so that it does not drift. Disparity enters only as its change since the
/// keyframe. Nothing when too little of the template fits.
std::optional<RigidMotion> measure_motion(const InstrumentKeyframe& keyframe, const ImageLayers& left,
                                          const ImageLayers& right, const Rectification& rectification,
                                          const RigidMotion& guess, Light light);

}  // namespace palpate
