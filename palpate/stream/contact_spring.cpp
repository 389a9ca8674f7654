#include "palpate/stream/contact_spring.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace palpate {

namespace {

/// The nearest stiffness of a spring: what pushes by itself, or turns, could drive a haptic device.
Mat3 passive(const Mat3& stiffness) {
  const Mat3 symmetric = 0.5 * (stiffness + stiffness.transpose());
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(symmetric);
  return axes.eigenvectors() * axes.eigenvalues().cwiseMax(0.0).asDiagonal() * axes.eigenvectors().transpose();
}

}  // namespace

ContactSpring contact_spring(const ForceEstimate& estimate, double friction, int64_t decoded_ns) {
  ContactSpring spring;
  spring.frame = estimate.frame;
  spring.decoded_ns = decoded_ns;
  spring.valid = estimate.status == FrameStatus::ok || estimate.status == FrameStatus::no_contact;
  spring.valid &= estimate.force_N.allFinite() && estimate.tangent.stiffness_N_per_mm.allFinite();
  spring.tip_mm = estimate.tip_mm;
  spring.tip_velocity_mm_per_s = estimate.tip_velocity_mm_per_s;
  if (!spring.valid || !estimate.in_contact) return spring;
  spring.in_contact = true;
  spring.force_N = estimate.force_N;
  spring.tangent = estimate.tangent;
  spring.tangent.stiffness_N_per_mm = passive(estimate.tangent.stiffness_N_per_mm);
  if (estimate.grip == Hold::push || estimate.grip == Hold::slide) spring.friction = friction;
  return spring;
}

Vec3 force_at(const ContactSpring& spring, const Vec3& moved_mm) {
  if (!spring.valid || !spring.in_contact) return Vec3::Zero();
  const Vec3 force_N = spring.force_N + spring.tangent.stiffness_N_per_mm * moved_mm;
  if (spring.friction < 0) return force_N;
  const double pressing_N = -force_N.dot(spring.tangent.normal);
  if (pressing_N <= 0) return Vec3::Zero();
  const Vec3 along_N = force_N + pressing_N * spring.tangent.normal;
  const double max_N = spring.friction * pressing_N, along = along_N.norm();
  return -pressing_N * spring.tangent.normal + (along > max_N ? max_N / along : 1.0) * along_N;
}

double stored_energy_Nmm(const ContactSpring& spring, const Mat3& at_onset_N_per_mm, const Vec3& moved_mm) {
  if (!spring.valid || !spring.in_contact) return 0;
  const Vec3 q_mm = spring.tangent.displacement_mm;
  const double at_frame =
      0.5 * spring.force_N.dot(q_mm) + q_mm.dot((at_onset_N_per_mm - spring.tangent.stiffness_N_per_mm) * q_mm) / 12;
  const double since = spring.force_N.dot(moved_mm) + 0.5 * moved_mm.dot(spring.tangent.stiffness_N_per_mm * moved_mm);
  return std::max(0.0, at_frame + since);
}

}  // namespace palpate
