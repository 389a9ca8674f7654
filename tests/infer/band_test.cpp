#include "palpate/infer/band.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

TEST(Band, IsTheQuantilesOfTheMagnitudeAlongTheForce) {
  Mat3 covariance = Mat3::Zero();
  covariance(0, 0) = 0.25, covariance(2, 2) = 9;
  const ForceBand band = force_band({4, 0, 0}, covariance);
  EXPECT_NEAR(band.low_N, 4 - 0.98, 1e-9);
  EXPECT_NEAR(band.high_N, 4 + 0.98, 1e-9);
}

TEST(Band, IsNeverBelowZero) {
  EXPECT_EQ(force_band({0.1, 0, 0}, Mat3::Identity()).low_N, 0);
  EXPECT_GT(force_band(Vec3::Zero(), Mat3::Identity()).high_N, 1);
}

TEST(Band, WhatGoesUnnoticedGrowsWithModulusAndPatch) {
  const InferenceParameters parameters;
  const TissueOptions liver{Law::saint_venant_kirchhoff, 27, 0.45, ""},
      uterus{Law::saint_venant_kirchhoff, 270, 0.45, ""};
  const double small_N = unnoticed_force_N(liver, 2, parameters);
  EXPECT_NEAR(unnoticed_force_N(uterus, 2, parameters), 10 * small_N, 1e-9);
  EXPECT_NEAR(unnoticed_force_N(liver, 4, parameters), 2 * small_N, 1e-9);
}

}  // namespace
}  // namespace palpate
