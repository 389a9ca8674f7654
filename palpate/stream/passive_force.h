#pragma once

#include <optional>

#include "palpate/stream/contact_spring.h"

namespace palpate {

/// What no force of the loop goes beyond.
struct ForceLimits {
  double magnitude_N = 5;
  double rate_N_per_s = 100;
};

/// The force of one step.
struct SteppedForce {
  Vec3 force_N = Vec3::Zero();  ///< of the instrument on the tissue
  bool valid = false;
  bool limited = false;  ///< magnitude or rate
  bool damped = false;   ///< less than the spring's, so that no energy is made
};

/// From springs that frames replace to one smooth, passive force. Between two frames a spring makes no energy, but
/// changing it does: what has been put in since onset is counted (passivity observer: Hannaford, Ryu 2002), and on the
/// way back the force along the motion is that fraction of the spring's that the energy put in is of the energy stored.
/// Without a spring, or with an invalid one, the force ramps to zero within 20 ms. Steps by its caller's clock.
class PassiveForce {
 public:
  explicit PassiveForce(const ForceLimits& limits) : limits_(limits) {}

  /// A new frame's spring; the force goes over to it within milliseconds.
  void use(const ContactSpring& spring);
  /// The tip now, moved since the spring's frame by `moved_mm`; `alive`: frames still come.
  SteppedForce step(const Vec3& tip_mm, const Vec3& moved_mm, bool alive, double seconds);

  /// Put in by the tip since onset, less what was given back, N mm; never much below zero.
  double energy_Nmm() const { return energy_Nmm_; }

 private:
  Vec3 without_made_energy(const Vec3& force_N, const Vec3& moved_mm, bool& damped) const;

  ForceLimits limits_;
  ContactSpring spring_;
  Mat3 at_onset_N_per_mm_ = Mat3::Zero();
  bool fresh_ = false;
  Vec3 going_over_N_ = Vec3::Zero();  ///< from the last spring's force to this one's
  Vec3 wanted_N_ = Vec3::Zero();
  double gain_ = 0;  ///< 0 to 1: ramps
  double energy_Nmm_ = 0;
  std::optional<Vec3> last_tip_mm_;
  Vec3 velocity_mm_per_s_ = Vec3::Zero();
  Vec3 force_N_ = Vec3::Zero();
};

}  // namespace palpate
