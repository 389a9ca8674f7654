#pragma once

#include <Eigen/Core>
#include <vector>

#include "palpate/core/geometry.h"
#include "palpate/infer/belief.h"

namespace palpate {

/// Sizes are known to be small, so that nothing is allocated: a measured vector has at most 3 values, and there are at
/// most those of two contacts.
inline constexpr int kMaxValues = 3, kMaxUnknowns = Unknowns::kScene + 2 * Unknowns::kContact;

/// One vector that was measured, to first order around a point x0 of the unknowns: z - h(x) = residual - H (x - x0).
struct Measurement {
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxValues, 1> residual;                   ///< z - h(x0)
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxValues, kMaxUnknowns> H;  ///< dh/dx, per unknown
  /// Of z: the scale matrix of the Student-t density.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxValues, kMaxValues> covariance;
  double dof = 5;     ///< its degrees of freedom
  double weight = 1;  ///< power of its likelihood: below 1 where it shares its errors with others
};

struct MapEstimate {
  Belief posterior;         ///< Gaussian at the maximum
  double log_evidence = 0;  ///< log marginal likelihood of the measurements (Laplace)
  double chi2 = 0;          ///< weighted, of the measurements at the maximum
  double dof = 0;           ///< weighted number of measured values
};

/// Maximum a posteriori of linearized measurements with heavy tails, by iteratively reweighted least squares.
/// `x0`: where they were linearized.
MapEstimate maximum_a_posteriori(const Belief& prior, const Eigen::VectorXd& x0,
                                 const std::vector<Measurement>& measurements);

/// log density of a vector under a Student-t distribution with this squared Mahalanobis distance.
double log_student_t(double distance2, double log_determinant, double size, double dof);

}  // namespace palpate
