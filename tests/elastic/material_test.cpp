#include "palpate/elastic/material.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace palpate {
namespace {

const Law kLaws[] = {Law::saint_venant_kirchhoff, Law::neo_hookean};

Lame liver() {
  return lame_of({Law::saint_venant_kirchhoff, 27, 0.45, ""});
}

Mat3 random_gradient(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-0.25, 0.25);
  Mat3 F = Mat3::Identity();
  for (int i = 0; i < 9; ++i) F.data()[i] += uniform(random);
  return F;
}

TEST(Material, LameConstantsGiveBackYoungsModulusAndPoissonsRatio) {
  const Lame lame = liver();
  const double E = lame.mu * (3 * lame.lambda + 2 * lame.mu) / (lame.lambda + lame.mu);
  EXPECT_NEAR(E, 0.027, 1e-12);
  EXPECT_NEAR(lame.lambda / (2 * (lame.lambda + lame.mu)), 0.45, 1e-12);
}

TEST(Material, StressIsTheGradientOfTheEnergy) {
  std::mt19937 random(1);
  for (Law law : kLaws)
    for (int trial = 0; trial < 20; ++trial) {
      const Mat3 F = random_gradient(random);
      const Mat3 P = first_piola_stress(law, liver(), F);
      for (int i = 0; i < 9; ++i) {
        Mat3 plus = F, minus = F;
        plus.data()[i] += 1e-6;
        minus.data()[i] -= 1e-6;
        const double slope = (energy_density(law, liver(), plus) - energy_density(law, liver(), minus)) / 2e-6;
        EXPECT_NEAR(slope, P.data()[i], 1e-7 * P.norm() + 1e-11);
      }
    }
}

TEST(Material, TangentIsTheDerivativeOfTheStressAndSymmetric) {
  std::mt19937 random(2);
  for (Law law : kLaws)
    for (int trial = 0; trial < 20; ++trial) {
      const Mat3 F = random_gradient(random);
      const Mat9 C = stress_derivative(law, liver(), F);
      EXPECT_LT((C - C.transpose()).norm(), 1e-12 * C.norm());
      for (int i = 0; i < 9; ++i) {
        Mat3 plus = F, minus = F;
        plus.data()[i] += 1e-6;
        minus.data()[i] -= 1e-6;
        const Mat3 slope = (first_piola_stress(law, liver(), plus) - first_piola_stress(law, liver(), minus)) / 2e-6;
        EXPECT_LT((Eigen::Map<const Eigen::Matrix<double, 9, 1>>(slope.data()) - C.col(i)).norm(), 1e-7 * C.norm());
      }
    }
}

TEST(Material, TheVolumeRatioAndItsDerivativesBelongTogether) {
  std::mt19937 random(4);
  for (Law law : kLaws)
    for (int trial = 0; trial < 20; ++trial) {
      const Mat3 F = random_gradient(random), G = volume_ratio_gradient(law, F);
      const Mat9 C = volume_ratio_curvature(law, F);
      for (int i = 0; i < 9; ++i) {
        Mat3 plus = F, minus = F;
        plus.data()[i] += 1e-5;
        minus.data()[i] -= 1e-5;
        EXPECT_NEAR((volume_ratio(law, plus) - volume_ratio(law, minus)) / 2e-5, G.data()[i], 1e-9);
        const Mat3 slope = (volume_ratio_gradient(law, plus) - volume_ratio_gradient(law, minus)) / 2e-5;
        EXPECT_LT((Eigen::Map<const Eigen::Matrix<double, 9, 1>>(slope.data()) - C.col(i)).norm(), 1e-9);
      }
    }
}

TEST(Material, TheBulkEnergyAndTheRestMakeTheWholeLaw) {
  std::mt19937 random(5);
  for (Law law : kLaws) {
    const Mat3 F = random_gradient(random);
    const double growth = volume_ratio(law, F) - 1;
    EXPECT_NEAR(energy_density(law, without_bulk(liver()), F) + 0.5 * bulk_modulus(liver()) * growth * growth,
                energy_density(law, liver(), F), 1e-15);
  }
}

TEST(Material, ARotationCarriesTheStressAlong) {
  std::mt19937 random(3);
  const Mat3 R = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  for (Law law : kLaws) {
    EXPECT_LT(first_piola_stress(law, liver(), R).norm(), 1e-15);
    const Mat3 F = random_gradient(random);
    const Mat3 turned = cauchy_stress(law, liver(), R * F),
               expected = R * cauchy_stress(law, liver(), F) * R.transpose();
    EXPECT_LT((turned - expected).norm(), 1e-12 * expected.norm());
  }
}

TEST(Material, BothLawsAgreeWithHookesLawAtSmallStrain) {
  Mat3 strain;
  strain << 1, 0.3, -0.2, 0.3, -2, 0.5, -0.2, 0.5, 0.7;
  strain *= 1e-7;
  const Lame lame = liver();
  const Mat3 hooke = lame.lambda * strain.trace() * Mat3::Identity() + 2 * lame.mu * strain;
  for (Law law : kLaws)
    EXPECT_LT((cauchy_stress(law, lame, Mat3::Identity() + strain) - hooke).norm(), 1e-5 * hooke.norm());
}

TEST(Material, SaintVenantKirchhoffInUniaxialStrainHasItsClosedForm) {
  const Lame lame = liver();
  const double stretch = 1.3, green = 0.5 * (stretch * stretch - 1);
  const Mat3 F = Vec3(stretch, 1, 1).asDiagonal();
  const Mat3 P = first_piola_stress(Law::saint_venant_kirchhoff, lame, F);
  EXPECT_NEAR(P(0, 0), stretch * (lame.lambda + 2 * lame.mu) * green, 1e-12);
  EXPECT_NEAR(P(1, 1), lame.lambda * green, 1e-12);
}

TEST(Material, VonMisesOfKnownStatesIsTheirClosedForm) {
  EXPECT_NEAR(von_mises(Vec3(-5, 0, 0).asDiagonal()), 5, 1e-12);
  Mat3 shear = Mat3::Zero();
  shear(0, 1) = shear(1, 0) = 2;
  EXPECT_NEAR(von_mises(shear), 2 * std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(von_mises(7 * Mat3::Identity()), 0, 1e-12);
}

}  // namespace
}  // namespace palpate
