#include "palpate/stream/passive_force.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// A step of force is a kick.
constexpr double kRamp_s = 0.02;
constexpr double kGoingOver_s = 0.005;
constexpr double kVelocityMean_s = 0.005;
/// Slower than this, a tip neither puts in nor takes out anything that could be felt.
constexpr double kSlow_mm_per_s = 0.2;

}  // namespace

void PassiveForce::use(const ContactSpring& spring) {
  if (!spring_.in_contact && spring.in_contact) {
    at_onset_N_per_mm_ = spring.tangent.stiffness_N_per_mm;
    energy_Nmm_ = std::min(energy_Nmm_, 0.0);
  }
  spring_ = spring;
  fresh_ = true;
}

Vec3 PassiveForce::without_made_energy(const Vec3& force_N, const Vec3& moved_mm, bool& damped) const {
  const double speed = velocity_mm_per_s_.norm(), power = force_N.dot(velocity_mm_per_s_);
  if (power >= 0) return force_N;
  const double stored_Nmm = stored_energy_Nmm(spring_, at_onset_N_per_mm_, moved_mm);
  if (energy_Nmm_ >= stored_Nmm) return force_N;
  damped = true;
  const double fraction = stored_Nmm > 0 ? std::max(0.0, energy_Nmm_) / stored_Nmm : 0;
  const double moving = speed * speed / (speed * speed + kSlow_mm_per_s * kSlow_mm_per_s);
  return force_N - moving * (1 - fraction) * power / (speed * speed) * velocity_mm_per_s_;
}

SteppedForce PassiveForce::step(const Vec3& tip_mm, const Vec3& moved_mm, bool alive, double seconds) {
  SteppedForce answer;
  if (last_tip_mm_) {
    const Vec3 way_mm = tip_mm - *last_tip_mm_;
    energy_Nmm_ += force_N_.dot(way_mm);  // the force was held on the way here
    velocity_mm_per_s_ += std::min(1.0, seconds / kVelocityMean_s) * (way_mm / seconds - velocity_mm_per_s_);
  }
  last_tip_mm_ = tip_mm;

  answer.valid = alive && spring_.valid;
  if (answer.valid) {
    const Vec3 spring_N = force_at(spring_, moved_mm);
    if (fresh_) going_over_N_ = wanted_N_ - spring_N;
    going_over_N_ *= std::exp(-seconds / kGoingOver_s);
    wanted_N_ = spring_N + going_over_N_;
  }
  fresh_ = false;
  gain_ = std::clamp(gain_ + (answer.valid ? seconds : -seconds) / kRamp_s, 0.0, 1.0);
  if (gain_ == 0) wanted_N_.setZero();

  Vec3 force_N = gain_ * without_made_energy(wanted_N_, moved_mm, answer.damped);
  if (const double magnitude_N = force_N.norm(); magnitude_N > limits_.magnitude_N) {
    force_N *= limits_.magnitude_N / magnitude_N;
    answer.limited = true;
  }
  const Vec3 change_N = force_N - force_N_;
  const double max_N = limits_.rate_N_per_s * seconds;
  // The ramp to zero is never held up.
  if (answer.valid && change_N.norm() > max_N) {
    force_N = force_N_ + max_N / change_N.norm() * change_N;
    answer.limited = true;
  }
  force_N_ = answer.force_N = force_N;
  return answer;
}

}  // namespace palpate
