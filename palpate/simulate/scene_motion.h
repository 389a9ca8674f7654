#pragma once

#include "palpate/simulate/simulate_options.h"

namespace palpate {

// How the scene moves by itself. Everything is at rest in the first frame and moves without a jump in velocity.

/// By how much organ and background are displaced by breathing and heart, axes of the left camera. There and back:
/// motion_mm (1 - cos(2 pi t / period_s)) / 2 for each.
Vec3 organ_motion_mm(const SimulateOptions& options, double time_s);

/// Strain that the attachments follow, along the axes of the left camera.
Vec3 attachment_strain(const SimulatedStretch& stretch, double time_s);

/// By how much the cameras have moved.
Vec3 camera_motion_mm(const SimulatedPan& pan, double time_s);

/// The tissue moves by itself beneath a hand that does not go with it.
bool moves_beneath_hand(const SimulateOptions& options);

/// The tip is behind gauze.
bool is_obscured(const SimulatedObscured& obscured, double time_s);

}  // namespace palpate
