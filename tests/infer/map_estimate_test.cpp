#include "palpate/infer/map_estimate.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace palpate {
namespace {

/// So many degrees of freedom that Student's t is a Gaussian.
constexpr double kGaussian = 1e7;

Belief two_unknowns() {
  Eigen::VectorXd mean(2);
  mean << 1, -2;
  Eigen::MatrixXd covariance(2, 2);
  covariance << 4, 1, 1, 2;
  return {mean, covariance};
}

Measurement of_sum(double value, double deviation, const Eigen::VectorXd& x0, double dof = kGaussian) {
  Measurement m;
  m.residual.setConstant(1, value - x0.sum());
  m.H.setConstant(1, 2, 1);
  m.covariance.setConstant(1, 1, deviation * deviation);
  m.dof = dof;
  return m;
}

TEST(MapEstimate, OfOneGaussianMeasurementIsTheKalmanUpdate) {
  const Belief prior = two_unknowns();
  const Eigen::VectorXd x0 = Eigen::VectorXd::Constant(2, 0.7);  // where it is linearized must not matter
  const MapEstimate estimate = maximum_a_posteriori(prior, x0, {of_sum(3, 0.5, x0)});
  const Eigen::RowVector2d h(1, 1);
  const double innovation_variance = (h * prior.covariance * h.transpose())(0) + 0.25;
  const Eigen::Vector2d gain = prior.covariance * h.transpose() / innovation_variance;
  const Eigen::Vector2d mean = prior.mean + gain * (3 - prior.mean.sum());
  const Eigen::Matrix2d covariance = prior.covariance - gain * h * prior.covariance;
  EXPECT_TRUE(estimate.posterior.mean.isApprox(mean, 1e-5));
  EXPECT_TRUE(estimate.posterior.covariance.isApprox(covariance, 1e-5));
  const double log_density = -0.5 * (std::pow(3 - prior.mean.sum(), 2) / innovation_variance +
                                     std::log(2 * std::numbers::pi * innovation_variance));
  EXPECT_NEAR(estimate.log_evidence, log_density, 1e-4);
}

TEST(MapEstimate, OneOutlierAmongManyHardlyMovesTheAnswer) {
  const Belief prior = two_unknowns();
  std::vector<Measurement> rows;
  for (int i = 0; i < 20; ++i) rows.push_back(of_sum(3 + 0.01 * (i % 3 - 1), 0.1, prior.mean, 4));
  const double without = maximum_a_posteriori(prior, prior.mean, rows).posterior.mean.sum();
  rows.push_back(of_sum(50, 0.1, prior.mean, 4));
  EXPECT_NEAR(maximum_a_posteriori(prior, prior.mean, rows).posterior.mean.sum(), without, 0.01);
}

TEST(MapEstimate, HalfTheWeightIsHalfTheInformation) {
  const Belief prior = two_unknowns();
  Measurement once = of_sum(3, 0.5, prior.mean), half = once;
  half.weight = 0.5;
  const Eigen::MatrixXd one = maximum_a_posteriori(prior, prior.mean, {once}).posterior.covariance,
                        two = maximum_a_posteriori(prior, prior.mean, {half, half}).posterior.covariance;
  EXPECT_TRUE(one.isApprox(two, 1e-6));
}

TEST(MapEstimate, StudentsDensityIntegratesToOne) {
  double sum = 0;
  constexpr double kStep = 0.01;
  for (double x = -400; x < 400; x += kStep) sum += kStep * std::exp(log_student_t(x * x / 4, std::log(4.0), 1, 3));
  EXPECT_NEAR(sum, 1, 1e-3);
}

}  // namespace
}  // namespace palpate
