#pragma once

#include <Eigen/Core>

#include "palpate/core/geometry.h"

namespace palpate {

/// Kalman filter of the tip with position and velocity. Between frames it moves either by the measured displacement of
/// the instrument (so that it does not lag) or, without one, with constant velocity.
class TipFilter {
 public:
  bool started() const { return started_; }
  void start(const Vec3& position_mm, const Mat3& covariance_mm2);
  void stop() { started_ = false; }

  /// Constant velocity; the acceleration of a hand is the noise.
  void predict(double seconds);
  /// In place of predict: the displacement since the last frame was measured.
  void move(const Vec3& displacement_mm, const Mat3& covariance_mm2, double seconds);
  /// Takes in an absolute measurement. False, and unchanged, when it lies outside the gate (3 degrees of freedom, 99.9
  /// %).
  bool correct(const Vec3& position_mm, const Mat3& covariance_mm2);

  Vec3 position_mm() const { return state_.head<3>(); }
  Vec3 velocity_mm_per_s() const { return state_.tail<3>(); }
  Mat3 position_covariance_mm2() const { return covariance_.topLeftCorner<3, 3>(); }

 private:
  Eigen::Matrix<double, 6, 1> state_ = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::Matrix<double, 6, 6> covariance_ = Eigen::Matrix<double, 6, 6>::Identity();
  bool started_ = false;
};

}  // namespace palpate
