#pragma once

#include <cstdint>

#include "palpate/estimate/force_estimate.h"

namespace palpate {

/// What the frame loop tells the force loop: the force for a tip near the frame's. Left camera frame.
struct ContactSpring {
  int frame = -1;
  int64_t decoded_ns = 0;  ///< steady clock, when the frame's pictures were there
  bool valid = false;      ///< the status promises a force
  bool in_contact = false;
  Vec3 tip_mm = Vec3::Zero();
  Vec3 tip_velocity_mm_per_s = Vec3::Zero();
  bool has_kinematic_tip = false;
  Vec3 kinematic_tip_mm = Vec3::Zero();  ///< of the track, as it was when the frame's pictures were there
  Vec3 force_N = Vec3::Zero();           ///< of the instrument on the tissue
  ContactTangent tangent;                ///< stiffness: symmetric, no negative eigenvalue
  double friction = -1;                  ///< of a push, which never pulls; negative: the tissue is held
};

/// `friction`: Coulomb coefficient of a push.
ContactSpring contact_spring(const ForceEstimate& estimate, double friction, int64_t decoded_ns);

/// Force of the instrument on the tissue for a tip that has moved since the frame.
Vec3 force_at(const ContactSpring& spring, const Vec3& moved_mm);

/// What the tissue gives back on the way to its rest, N mm: along the straight way there the force is the cubic through
/// the stiffness at both its ends. `at_onset_N_per_mm`: the stiffness of the contact's first frame.
double stored_energy_Nmm(const ContactSpring& spring, const Mat3& at_onset_N_per_mm, const Vec3& moved_mm);

}  // namespace palpate
