#include "palpate/instrument/tip_filter.h"

#include <Eigen/LU>

namespace palpate {

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr double kAcceleration_mm_per_s2 = 500;  // one standard deviation; a gesture starts and stops within two frames
constexpr double kStartSpeed_mm_per_s = 50;
constexpr double kGate = 16.3;  // chi-square, 3 degrees of freedom, 99.9 %

}  // namespace

void TipFilter::start(const Vec3& position_mm, const Mat3& covariance_mm2) {
  state_ << position_mm, Vec3::Zero();
  covariance_.setZero();
  covariance_.topLeftCorner<3, 3>() = covariance_mm2;
  covariance_.bottomRightCorner<3, 3>() = kStartSpeed_mm_per_s * kStartSpeed_mm_per_s * Mat3::Identity();
  started_ = true;
}

void TipFilter::predict(double seconds) {
  Matrix6 transition = Matrix6::Identity();
  transition.topRightCorner<3, 3>() = seconds * Mat3::Identity();
  const double a2 = kAcceleration_mm_per_s2 * kAcceleration_mm_per_s2;
  const double t2 = seconds * seconds;
  state_ = transition * state_;
  covariance_ = transition * covariance_ * transition.transpose();
  covariance_.topLeftCorner<3, 3>() += 0.25 * t2 * t2 * a2 * Mat3::Identity();
  covariance_.topRightCorner<3, 3>() += 0.5 * t2 * seconds * a2 * Mat3::Identity();
  covariance_.bottomLeftCorner<3, 3>() += 0.5 * t2 * seconds * a2 * Mat3::Identity();
  covariance_.bottomRightCorner<3, 3>() += t2 * a2 * Mat3::Identity();
}

void TipFilter::move(const Vec3& displacement_mm, const Mat3& covariance_mm2, double seconds) {
  const double t = std::max(seconds, 1e-3);
  const Mat3 position = covariance_.topLeftCorner<3, 3>() + covariance_mm2;
  state_.head<3>() += displacement_mm;
  state_.tail<3>() = displacement_mm / t;
  covariance_.setZero();
  covariance_.topLeftCorner<3, 3>() = position;
  covariance_.bottomRightCorner<3, 3>() = covariance_mm2 / (t * t);
}

bool TipFilter::correct(const Vec3& position_mm, const Mat3& covariance_mm2) {
  const Mat3 innovation_covariance = position_covariance_mm2() + covariance_mm2;
  const Mat3 inverse = innovation_covariance.inverse();
  const Vec3 innovation = position_mm - state_.head<3>();
  if (innovation.dot(inverse * innovation) > kGate) return false;
  const Eigen::Matrix<double, 6, 3> gain = covariance_.leftCols<3>() * inverse;
  state_ += gain * innovation;
  covariance_ -= gain * covariance_.topRows<3>();
  covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
  return true;
}

}  // namespace palpate
