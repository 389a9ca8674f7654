#include "palpate/infer/correlation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "palpate/infer/contact_fit.h"

namespace palpate {
namespace {

ForceAt force_along_z(Eigen::Index unknown, double N_per_unit, Eigen::Index unknowns) {
  ForceAt force;
  force.force_N = {0, 0, 2};
  force.per_unknown = Eigen::MatrixXd::Zero(3, unknowns);
  force.per_unknown(2, unknown) = N_per_unit;
  return force;
}

Belief one_contact() {
  const Eigen::Index n = Unknowns::count(1);
  return {Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Identity(n, n)};
}

TEST(Correlation, AForceThatHangsOnTheRadiusAloneCorrelatesWithNothingElse) {
  const Belief belief = one_contact();
  const ForceCorrelation c =
      force_correlation(force_along_z(Unknowns::log_radius(0), 3, belief.mean.size()), belief, 0);
  EXPECT_DOUBLE_EQ(c.radius, 1);
  EXPECT_EQ(c.scene_motion, 0);
  EXPECT_EQ(c.disparity_bias, 0);
  EXPECT_EQ(c.offset, 0);
  EXPECT_EQ(c.skew, 0);
}

TEST(Correlation, TwoUnknownsOfOneKindExplainTogetherWhatEachExplainsInPart) {
  Belief belief = one_contact();
  const Eigen::Index q = Unknowns::q(0), x = Unknowns::kTranslation, y = x + 1;
  // cov(q, x) = 0.6, cov(q, y) = 0.48, x and y independent: together sqrt(0.36 + 0.2304).
  belief.covariance(q, x) = belief.covariance(x, q) = 0.6;
  belief.covariance(q, y) = belief.covariance(y, q) = 0.48;
  const ForceCorrelation c = force_correlation(force_along_z(q, 5, belief.mean.size()), belief, 0);
  EXPECT_NEAR(c.scene_motion, std::sqrt(0.36 + 0.2304), 1e-12);
  EXPECT_EQ(c.radius, 0);
}

}  // namespace
}  // namespace palpate
