#include "palpate/infer/agreed_radius.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate {
namespace {

TEST(AgreedRadius, TissueThatSaysNothingLeavesTheStatedRadius) {
  InferenceParameters parameters;
  parameters.stated_right = 1;
  const AgreedRadius agreed = agreed_radius(std::log(9.0), 1e6, std::log(3.0), parameters);
  EXPECT_NEAR(agreed.log_radius, std::log(3.0), 1e-6);
  EXPECT_NEAR(agreed.variance, std::pow(parameters.stated_radius, 2), 1e-6);
}

TEST(AgreedRadius, AnOperatorWhoIsNeverRightLeavesTheTissuesRadius) {
  InferenceParameters parameters;
  parameters.stated_right = 0;
  const AgreedRadius agreed = agreed_radius(std::log(9.0), 0.01, std::log(3.0), parameters);
  EXPECT_NEAR(agreed.log_radius, std::log(9.0), 1e-12);
  EXPECT_NEAR(agreed.variance, 0.01 + std::pow(parameters.tissue_radius, 2), 1e-12);
}

TEST(AgreedRadius, ASmallContradictionGoesToTheOperatorAndAGreatOneToTheTissue) {
  const InferenceParameters parameters;
  const auto kept_of = [&](double ratio) {
    return 1 - agreed_radius(std::log(ratio), 0.01, 0, parameters).log_radius / std::log(ratio);
  };
  EXPECT_GT(kept_of(1.1), 0.5);
  EXPECT_LT(kept_of(2.5), 0.1);
  EXPECT_NEAR(kept_of(2.5), kept_of(1 / 2.5), 1e-12);
}

TEST(AgreedRadius, IsLeastSureWhereNobodyCanTellWhoIsRight) {
  const InferenceParameters parameters;
  const double agreeing = agreed_radius(0, 0.001, 0, parameters).variance,
               apart = agreed_radius(0.45, 0.001, 0, parameters).variance,
               far_apart = agreed_radius(1.2, 0.001, 0, parameters).variance;
  EXPECT_GT(apart, agreeing);
  EXPECT_GT(apart, far_apart);
}

}  // namespace
}  // namespace palpate
