#include "palpate/simulate/scene_motion.h"

#include <cmath>
#include <numbers>

#include "palpate/simulate/gesture.h"

namespace palpate {
namespace {

// 0 at the start, 1 after half a period, 0 after a whole one.
double there_and_back(double time_s, double period_s) {
  return 0.5 * (1 - std::cos(2 * std::numbers::pi * time_s / period_s));
}

}  // namespace

Vec3 organ_motion_mm(const SimulateOptions& options, double time_s) {
  return there_and_back(time_s, options.breathing.period_s) * options.breathing.motion_mm +
         there_and_back(time_s, options.heart.period_s) * options.heart.motion_mm;
}

Vec3 attachment_strain(const SimulatedStretch& stretch, double time_s) {
  return there_and_back(time_s, stretch.period_s) * stretch.strain;
}

Vec3 camera_motion_mm(const SimulatedPan& pan, double time_s) {
  return minimum_jerk((time_s - pan.from_s) / pan.during_s) * pan.by_mm;
}

bool moves_beneath_hand(const SimulateOptions& options) {
  const bool moves = options.breathing.motion_mm != Vec3::Zero() || options.heart.motion_mm != Vec3::Zero() ||
                     options.stretch.strain != Vec3::Zero();
  return moves && options.breathing.instrument == SimulatedBreathing::Instrument::stands;
}

bool is_obscured(const SimulatedObscured& obscured, double time_s) {
  const double same_moment_s = 1e-9;  // times of frames agree up to rounding
  return time_s > obscured.from_s - same_moment_s && time_s < obscured.to_s - same_moment_s;
}

}  // namespace palpate
